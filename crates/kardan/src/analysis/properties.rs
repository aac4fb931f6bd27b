//! What follows from the structure: stability, decoupling and transmission zeros, indices, zeros at infinity.

use super::LinearSystem;
use super::images::{Image, Images};
use super::realisation::MOST_TRANSFORMED;
use super::structure::structure;
use crate::num::{Matrix, ModularMatrix, Polynomial, Rational};
use crate::results::{
    Complex, Minor, PolynomialRoots, Realisations, Structure, SystemProperties, TransformedSystem, Zeros,
};

/// Largest order of the matrices of Markov parameters whose rank is taken.
const MOST_ROWS: usize = 400;
/// Primes for one characteristic polynomial.
const MOST_PRIMES: usize = 400;

/// What follows from the structure of a system; `realisations` are its own, `None` where they are not known. In discrete time
/// stable means inside the unit circle.
///
/// Stability is decided by the signs of proven roots of exact characteristic polynomials, in discrete time after
/// `z = (1 + w) / (1 − w)`. Polynomials are brought back from several primes and confirmed modulo one more; zeros at infinity
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
    let stable = |chosen: &[usize]| decided_stable(&roots_of(chosen)?, discrete);
    let zeros = |chosen: &[usize]| roots_of(chosen).map(|polynomial| described(&polynomial));
    let certificate = &structure.certificate;
    let indices = |minor: &Option<Minor>, count: usize| minor.as_ref().map(|minor| indices(minor, count));
    SystemProperties {
        stable: stable(&[0, 1, 2, 3]),
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

/// Whether all roots are stable, by proven signs.
fn decided_stable(polynomial: &Polynomial, discrete: bool) -> Option<bool> {
    if polynomial.degree() == 0 {
        return Some(true);
    }
    let turned = if discrete { of_circle(polynomial) } else { polynomial.clone() };
    if turned.degree() < polynomial.degree() {
        // A root at z = −1 has gone to infinity.
        return Some(false);
    }
    Some(turned.proven_roots()?.iter().all(|root| root.0 < 0.0))
}

/// `(1 − w)ⁿ p((1 + w) / (1 − w))`: the inside of the unit circle becomes the left half-plane.
fn of_circle(polynomial: &Polynomial) -> Polynomial {
    let n = polynomial.degree();
    let linear = |slope: Rational| Polynomial::new(vec![Rational::ONE, slope]);
    let power =
        |base: &Polynomial, k: usize| (0..k).fold(Polynomial::constant(Rational::ONE), |all, _| all.times(base));
    let (up, down) = (linear(Rational::ONE), linear(Rational::NEG_ONE));
    (0..=n).fold(Polynomial::new(Vec::new()), |sum, k| {
        let term = power(&up, k).times(&power(&down, n - k));
        sum.plus(&term.scale(&polynomial.coefficient(k)))
    })
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
