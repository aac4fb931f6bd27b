//! What follows from the structure: stability, decoupling and transmission zeros, indices, zeros at infinity.

use super::LinearSystem;
use super::images::{Image, Images};
use super::realisation::MOST_TRANSFORMED;
use super::stability::{Plane, stability_of, stability_of_roots};
use super::structure::structure;
use crate::num::{Matrix, ModularMatrix, Polynomial, Rational};
use crate::results::{
    BorderMotion, Complex, Factor, Minor, PolynomialRoots, Realisations, Stability, StabilityVerdict, Structure,
    SystemProperties, TransformedSystem, Zeros,
};

/// Largest order of the matrices of Markov parameters whose rank is taken.
const MOST_ROWS: usize = 400;
/// States up to which ranks tell how long the chains of modes on the border are.
const MOST_RANKED: usize = 24;
/// Primes for one characteristic polynomial.
const MOST_PRIMES: usize = 400;

/// What follows from the structure of a system; `realisations` are its own, `None` where they are not known. In discrete time
/// stable means inside the unit circle.
///
/// Polynomials are brought back from several primes and confirmed modulo one more; zeros at infinity
/// are counted by ranks of block Toeplitz matrices of the Markov parameters modulo a prime.
pub fn properties(
    system: &LinearSystem,
    structure: &Structure,
    realisations: Option<&Realisations>,
    discrete: bool,
) -> SystemProperties {
    let one = || Polynomial::constant(Rational::ONE);
    let whole = || Some(vec![one(), characteristic(&system.explicit()?.a)?, one(), one()]);
    // Of a minimal system the one block is known without its coordinates.
    let alone = structure.minimality() == Some(true) && system.states.len() <= MOST_TRANSFORMED;
    let blocks: Option<Vec<Polynomial>> = match realisations {
        Some(found) => (0..4).map(|block| characteristic(&found.kalman.diagonal(block))).collect(),
        None => alone.then(whole).flatten(),
    };
    let order = realisations.map(|found| found.minimal.a.rows()).or(alone.then_some(system.states.len()));
    let roots_of = |chosen: &[usize]| {
        let blocks = blocks.as_ref()?;
        Some(chosen.iter().fold(Polynomial::constant(Rational::ONE), |all, &k| all.times(&blocks[k])))
    };
    let plane = if discrete { Plane::Discrete } else { Plane::Continuous };
    let stable = |chosen: &[usize]| Some(decided_stable(&roots_of(chosen)?, plane));
    let zeros = |chosen: &[usize]| roots_of(chosen).map(|polynomial| described(&polynomial));
    let certificate = &structure.certificate;
    let indices = |minor: &Option<Minor>, count: usize| minor.as_ref().map(|minor| indices(minor, count));
    SystemProperties {
        stability: system_stability(system, structure, plane),
        stabilisable: stable(&[2, 3]),
        detectable: stable(&[0, 2]),
        minimal_order: order,
        input_decoupling_zeros: zeros(&[2, 3]),
        output_decoupling_zeros: zeros(&[0, 2]),
        input_output_decoupling_zeros: zeros(&[2]),
        transmission_zeros: match realisations {
            Some(found) => transmission_zeros(structure, &found.minimal),
            None => alone.then(|| described_zeros(&structure.zeros)),
        },
        controllability_indices: indices(&certificate.reached, structure.inputs.len()),
        observability_indices: indices(&certificate.seen, structure.outputs.len()),
        infinite_zeros: infinite_zeros(system, structure.zeros.normal_rank),
    }
}

/// det(sI − A), exact.
fn characteristic(a: &Matrix<Rational>) -> Option<Polynomial> {
    let n = a.rows();
    if n == 0 {
        return Some(Polynomial::constant(Rational::ONE));
    }
    let alone = LinearSystem::state_space(a.clone(), Matrix::zeros(n, 0), Matrix::zeros(0, n));
    let coefficients = Images::unforeseen(&alone).reconstruct(MOST_PRIMES, |image| {
        let all = image.g.characteristic_polynomial(&image.field);
        Some(all.into_iter().map(|x| image.field.value(x)).collect())
    })?;
    Some(Polynomial::new(coefficients))
}

/// Whether all roots are inside the border of stability.
fn decided_stable(polynomial: &Polynomial, plane: Plane) -> bool {
    polynomial.degree() == 0 || stability_of_roots(polynomial, plane).word == Stability::Stable
}

/// Whether a system is stable: by the proven roots of its exact factors where these are written out, else by ranks of its exact matrix.
pub fn system_stability(system: &LinearSystem, structure: &Structure, plane: Plane) -> StabilityVerdict {
    let factors = &structure.factors;
    if plane == Plane::Continuous && factors.iter().all(|factor| !factor.roots.is_empty()) {
        return stability_of_factors(factors);
    }
    match system.explicit().filter(|_| system.states.len() <= MOST_RANKED) {
        Some(explicit) => stability_of(&explicit.a, plane),
        None => StabilityVerdict::undecided("the system has many states"),
    }
}

/// Of the factors of a characteristic polynomial with proven roots, whose parts are zero if and only if they are exactly.
fn stability_of_factors(factors: &[Factor]) -> StabilityVerdict {
    let all = factors.iter().flat_map(|factor| factor.roots.iter().map(move |root| (factor, root)));
    let outside = all.clone().any(|(_, root)| root.re > 0.0);
    let on_border = all.filter(|(_, root)| root.re == 0.0 && root.im >= 0.0);
    let border = on_border.map(|(factor, root)| BorderMotion {
        frequency: root.im,
        poles: factor.algebraic * if root.im > 0.0 { 2 } else { 1 },
        // Of g chains of m poles together one has at least ⌈m/g⌉.
        growth: factor.algebraic.div_ceil(factor.geometric.max(1)) - 1,
        free: false,
    });
    StabilityVerdict::exact(outside, border.collect())
}

fn described(polynomial: &Polynomial) -> PolynomialRoots {
    let values = polynomial.proven_roots().unwrap_or_else(|| polynomial.roots());
    PolynomialRoots { polynomial: polynomial.to_string(), values: Complex::list(values) }
}

pub(super) fn described_zeros(zeros: &Zeros) -> PolynomialRoots {
    PolynomialRoots { polynomial: zeros.polynomial.clone(), values: zeros.values.clone() }
}

/// Those of the minimal realisation.
fn transmission_zeros(whole: &Structure, minimal: &TransformedSystem) -> Option<PolynomialRoots> {
    if minimal.a.rows() == whole.states.len() {
        return Some(described_zeros(&whole.zeros));
    }
    if minimal.a.rows() == 0 {
        return Some(PolynomialRoots { polynomial: "1".into(), values: Vec::new() });
    }
    let system = LinearSystem {
        d: minimal.d.clone(),
        ..LinearSystem::state_space(minimal.a.clone(), minimal.b.clone(), minimal.c.clone())
    };
    structure(&system).ok().map(|found| described_zeros(&found.zeros))
}

/// How many columns `Aᵏ b` of each input are independent of those before, power by power.
fn indices(minor: &Minor, inputs: usize) -> Vec<usize> {
    (0..inputs).map(|input| minor.columns.iter().filter(|column| column.input == input).count()).collect()
}

/// Orders of the zeros at infinity of the transfer matrix of this rank.
fn infinite_zeros(system: &LinearSystem, normal_rank: usize) -> Option<Vec<usize>> {
    if normal_rank > 0 && system.outputs.len().max(system.inputs.len()) > MOST_ROWS {
        return None;
    }
    let mut orders = orders_at_infinity(system)?;
    orders.retain(|order| *order > 0);
    Some(orders)
}

/// Orders of the Smith form at infinity of the transfer matrix, ascending: of `ranks(k) − ranks(k − 1)` increments the k-th tells how many are
/// of order at most k.
pub(super) fn orders_at_infinity(system: &LinearSystem) -> Option<Vec<usize>> {
    let image = Images::unforeseen(system).get(0)?;
    let (n, p, m) = (system.states.len(), system.outputs.len(), system.inputs.len());
    let full = super::zeros::ZeroStructure::of(&image).rank - n;
    let (mut orders, mut before, mut known) = (Vec::new(), 0, 0);
    let mut markov = vec![image.d.clone()];
    let mut reached = image.b.clone();
    for order in 0..=n {
        if known == full {
            break;
        }
        if order > 0 {
            markov.push(image.c.multiply(&image.field, &reached));
            reached = image.g.multiply(&image.field, &reached);
        }
        if (order + 1) * p.max(m) > MOST_ROWS {
            return None;
        }
        let rank = toeplitz_rank(&image, &markov, [p, m]);
        let at_most = rank - before;
        orders.extend(std::iter::repeat_n(order, at_most - known));
        (before, known) = (rank, at_most);
    }
    Some(orders)
}

/// The rank of the lower block triangular Toeplitz matrix of these blocks.
fn toeplitz_rank(image: &Image, markov: &[ModularMatrix], [p, m]: [usize; 2]) -> usize {
    let count = markov.len();
    let entry = |i: usize, j: usize| match (i / p).checked_sub(j / m) {
        Some(k) => markov[k].row(i % p)[j % m],
        None => 0,
    };
    ModularMatrix::from_fn(count * p, count * m, entry).echelon(&image.field).1.len()
}
