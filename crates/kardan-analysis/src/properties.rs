//! Properties from the structure: stability, decoupling and transmission zeros, indices, zeros at infinity.

use super::LinearSystem;
use super::certified::{norm_bits, pencil_of};
use super::images::{Image, Images, fingerprint};
use super::indices::{indices, is_exact};
use super::realisation::{MOST_TRANSFORMED, diagonal_block};
use super::stability::{Plane, stability_of, stability_of_roots};
use super::structure::structure;
use kardan_math::num::{
    Matrix, ModularMatrix, Polynomial, Primes, Rational, Reconstruction, Residue, cayley, exact_rank, routh_column,
};
use kardan_results::{
    BorderMotion, Complex, Factor, PolynomialRoots, Realisations, Stability, StabilityProof, StabilityProofs,
    StabilityVerdict, Structure, SystemProperties, TransformedSystem, Zeros,
};

/// Largest order of the matrices of Markov parameters whose rank is taken.
const MOST_ROWS: usize = 400;
/// States up to which ranks determine the lengths of the chains of modes on the border.
const MOST_RANKED: usize = 24;
/// Of these, the largest one over the rationals.
const MOST_EXACT_ROWS: usize = 96;
/// Primes for one characteristic polynomial.
const MOST_PRIMES: usize = 400;

/// The properties that follow from the structure of a system; `realisations` are its own, `None` where they are not known. In discrete time
/// stable means inside the unit circle.
///
/// Stability is decided by the signs of proven roots of exact characteristic polynomials, in discrete time after
/// `z = (1 + w) / (1 − w)`. Polynomials are known from primes with a product above a bound of their coefficients. Indices and zeros at infinity
/// follow from ranks (of leading columns of the controllability matrix, of block Toeplitz matrices of Markov parameters), which are the largest
/// modulo a few primes that are drawn.
pub fn properties(
    system: &LinearSystem,
    structure: &Structure,
    realisations: Option<&Realisations>,
    discrete: bool,
) -> SystemProperties {
    let certified = structure.certificate.proven;
    let is_unforced = has_no_ports(system, structure);
    let blocks = blocks(system, structure, realisations);
    let order = realisations.map(|found| found.minimal.a.rows()).or(is_unforced.then_some(system.states.len()));
    let roots_of = |chosen: &[usize]| Some(product_of(blocks.as_ref()?, chosen));
    let plane = if discrete { Plane::Discrete } else { Plane::Continuous };
    let stable = |chosen: &[usize]| {
        let polynomial = roots_of(chosen)?;
        Some(polynomial.degree() == 0 || stability_of_roots(&polynomial, plane).word == Stability::Stable)
    };
    let zeros = |chosen: &[usize]| roots_of(chosen).map(|polynomial| described(&polynomial));
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
            None => is_unforced.then(|| described_zeros(&structure.zeros)),
        },
        controllability_indices: indices(system, certified),
        observability_indices: indices(&system.transpose(), certified),
        infinite_zeros: infinite_zeros(system, structure.zeros.normal_rank, certified),
    }
}

/// Proofs of what [`properties`] calls stable, stabilisable and detectable, or not.
pub fn stability_proofs(
    system: &LinearSystem,
    structure: &Structure,
    realisations: Option<&Realisations>,
    discrete: bool,
) -> StabilityProofs {
    let blocks = blocks(system, structure, realisations);
    let proof = |chosen: &[usize]| {
        let polynomial = product_of(blocks.as_ref()?, chosen);
        let transformed = if discrete { cayley(&polynomial) } else { polynomial.clone() };
        // Where the degree falls a root at z = −1 has gone to infinity.
        let column =
            if transformed.degree() < polynomial.degree() { vec![Rational::ZERO] } else { routh_column(&transformed) };
        Some(StabilityProof {
            polynomial: polynomial.to_string(),
            routh: column.iter().map(ToString::to_string).collect(),
        })
    };
    StabilityProofs { stable: proof(&[0, 1, 2, 3]), stabilisable: proof(&[2, 3]), detectable: proof(&[0, 2]) }
}

/// Names of those of [`properties`] that are computed modulo random primes only.
pub fn modular_properties(system: &LinearSystem, found: &SystemProperties) -> Vec<&'static str> {
    let is_modular = is_exact(system.states.len(), false) == Some(false);
    let rows = system.outputs.len().max(system.inputs.len());
    let last = found.infinite_zeros.as_ref().map_or(0, |orders| orders.iter().max().map_or(1, |order| order + 1));
    let mut out = Vec::new();
    if is_modular {
        out.push("controllability and observability indices");
    }
    if found.infinite_zeros.is_some() && (is_modular || last * rows > MOST_EXACT_ROWS) {
        out.push("zeros at infinity");
    }
    out
}

/// Whether a system of few states is minimal: its one block is known without its coordinates.
fn has_no_ports(system: &LinearSystem, structure: &Structure) -> bool {
    structure.minimality() == Some(true) && system.states.len() <= MOST_TRANSFORMED
}

/// Characteristic polynomials of the blocks of Kalman's decomposition.
fn blocks(
    system: &LinearSystem,
    structure: &Structure,
    realisations: Option<&Realisations>,
) -> Option<Vec<Polynomial>> {
    let one = || Polynomial::constant(Rational::ONE);
    let whole = || Some(vec![one(), characteristic(&system.explicit()?.a)?, one(), one()]);
    match realisations {
        Some(found) => (0..4).map(|block| characteristic(&diagonal_block(&found.kalman, block))).collect(),
        None => has_no_ports(system, structure).then(whole).flatten(),
    }
}

fn product_of(blocks: &[Polynomial], chosen: &[usize]) -> Polynomial {
    chosen.iter().fold(Polynomial::constant(Rational::ONE), |all, &k| all.times(&blocks[k]))
}

/// det(sI − A), exact: with whole rows its coefficients are below a bound (`certified`), and known modulo primes with a product above double that.
fn characteristic(a: &Matrix<Rational>) -> Option<Polynomial> {
    if a.rows() == 0 {
        return Some(Polynomial::constant(Rational::ONE));
    }
    let pencil = pencil_of(a);
    let needed = (norm_bits(&pencil) + 2).div_ceil(60) as usize;
    let mut reconstruction = Reconstruction::new();
    let images = (needed <= MOST_PRIMES).then(|| Primes::new(fingerprint(&pencil)))?;
    for image in images.filter_map(|prime| Image::new(&pencil, prime)).take(needed) {
        let monic = image.g.characteristic_polynomial(&image.field);
        let scaled = |x: &Residue| image.field.value(image.field.times(*x, image.determinant));
        reconstruction.add(image.field.prime(), &monic.iter().map(scaled).collect::<Vec<_>>());
    }
    Some(Polynomial::new(reconstruction.integers().into_iter().map(Rational::from).collect()).monic())
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
        growth_exponent: factor.algebraic.div_ceil(factor.geometric.max(1)) - 1,
        uncontrolled: false,
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

/// Orders of the zeros at infinity of the transfer matrix of this rank.
fn infinite_zeros(system: &LinearSystem, normal_rank: usize, certified: bool) -> Option<Vec<usize>> {
    if normal_rank > 0 && system.outputs.len().max(system.inputs.len()) > MOST_ROWS {
        return None;
    }
    let mut orders = orders_at_infinity(system, certified)?;
    orders.retain(|order| *order > 0);
    Some(orders)
}

/// Orders of the Smith form at infinity of the transfer matrix, ascending: of `ranks(k) − ranks(k − 1)` increments the k-th is the number of those that are
/// of order at most k.
pub(super) fn orders_at_infinity(system: &LinearSystem, certified: bool) -> Option<Vec<usize>> {
    let image = Images::unforeseen(system).get(0)?;
    let (n, p, m) = (system.states.len(), system.outputs.len(), system.inputs.len());
    let full = super::zeros::ZeroStructure::of(&image).rank - n;
    let (mut orders, mut before, mut counted) = (Vec::new(), 0, 0);
    let exact = is_exact(n, certified)?.then(|| system.explicit()).flatten();
    let mut exact = exact.map(|explicit| (vec![explicit.d], explicit.a, explicit.b, explicit.c));
    let mut markov = vec![image.d.clone()];
    let mut reached = image.b.clone();
    for order in 0..=n {
        if counted == full {
            break;
        }
        if order > 0 {
            markov.push(image.c.multiply(&image.field, &reached));
            reached = image.g.multiply(&image.field, &reached);
            if let Some((markov, a, reached, c)) = &mut exact {
                markov.push(c.multiply(reached));
                *reached = a.multiply(reached);
            }
        }
        if (order + 1) * p.max(m) > MOST_ROWS {
            return None;
        }
        // Of the lower block triangular Toeplitz matrix of these blocks.
        let (rows, columns) = ((order + 1) * p, (order + 1) * m);
        let block = |i: usize, j: usize| (i / p).checked_sub(j / m);
        let rank = match &exact {
            Some((markov, ..)) if rows.max(columns) <= MOST_EXACT_ROWS => {
                let entry = |i: usize, j: usize| block(i, j).map(|k| markov[k][(i % p, j % m)].clone());
                exact_rank(&Matrix::from_fn(rows, columns, |i, j| entry(i, j).unwrap_or(Rational::ZERO)))
            }
            Some(_) if certified => return None,
            _ => {
                let entry = |i: usize, j: usize| block(i, j).map_or(0, |k| markov[k].row(i % p)[j % m]);
                ModularMatrix::from_fn(rows, columns, entry).echelon(&image.field).1.len()
            }
        };
        let at_most = rank - before;
        orders.extend(std::iter::repeat_n(order, at_most - counted));
        (before, counted) = (rank, at_most);
    }
    Some(orders)
}
