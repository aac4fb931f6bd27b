//! Systems `E ẋ = A x + B u`, `y = C x + D u` with a singular E, exact.
//!
//! Where det(sE − A) is not zero for all s, the pencil separates: with `M = (s₀E − A)⁻¹E` for some regular s₀ the kernel of
//! `M^ν` is the part of infinite eigenvalues, its image that of finite ones (Wong 1974). In these coordinates
//! `ż = J z + B₁u` and `N ẇ = w + B₂u` with a nilpotent N, so `w = −Σ Nⁱ B₂ u⁽ⁱ⁾`: the transfer matrix is
//! `C₁ (sI − J)⁻¹ B₁ + D − Σ C₂ Nⁱ B₂ sⁱ`.

mod infinity;
mod separation;
mod singular;

pub use separation::DescriptorError;
pub use singular::SingularPencil;

use super::massless::plain_combination;
use super::parts::{joined, rows_of, side_by_side, stacked, texts};
use super::properties::{described_zeros, orders_at_infinity};
use super::structure::{pencil, structure};
use super::system::LinearSystem;
use infinity::{Side, verdicts};
use kardan_math::num::{Matrix, Polynomial, Rational, Scalar, exact_rank};
use kardan_results::{Definition, DescriptorSystem, ImproperEntry, PolynomialRoots, SeparatedPencil};
use separation::Separation;

/// Descriptor systems with more states are not separated.
pub const MOST_VARIABLES: usize = 200;

/// A descriptor system, and the state space that it is equivalent to.
#[derive(Debug, Clone, PartialEq)]
pub struct DecomposedDescriptor {
    /// The result.
    pub found: DescriptorSystem,
    /// `ż = J z + B u`, `y = C z + D u` for the outputs that respond to no derivative of an input; E is the identity.
    pub equivalent: LinearSystem,
}

/// Takes a descriptor system apart; E may be any square matrix.
///
/// ```
/// use kardan_analysis::{LinearSystem, descriptor};
/// use kardan_math::num::{Matrix, Rational};
/// let q = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // ẋ1 = −x1 + x2, 0 = x2 − u, y = x1 + x2: the transfer function is 1/(s + 1) + 1.
/// let mut system = LinearSystem::state_space(q(&[&[-1, 1], &[0, -1]]), q(&[&[0], &[1]]), q(&[&[1, 1]]));
/// system.e = q(&[&[1, 0], &[0, 0]]);
/// let apart = descriptor(&system).unwrap();
/// assert_eq!((apart.found.index, apart.found.finite_eigenvalues), (1, 1));
/// assert_eq!((apart.equivalent.a, apart.equivalent.d), (q(&[&[-1]]), q(&[&[1]])));
/// ```
///
/// # Errors
/// [`DescriptorError`].
pub fn descriptor(system: &LinearSystem) -> Result<DecomposedDescriptor, DescriptorError> {
    if system.states.len() > MOST_VARIABLES {
        return Err(DescriptorError::TooLarge);
    }
    let apart = Separation::of(system)?;
    let (states, definitions) = named(&apart.reading, &system.states);
    let slow = LinearSystem {
        states,
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        d: apart.polynomial[0].clone(),
        degrees_of_freedom: None,
        ..LinearSystem::state_space(apart.slow[0].clone(), apart.slow[1].clone(), apart.slow[2].clone())
    };
    let derivatives = &apart.polynomial[1..];
    let polynomial_part = improper(derivatives, system);
    let proper: Vec<usize> = (0..system.outputs.len())
        .filter(|&i| derivatives.iter().all(|matrix| matrix.row(i).iter().all(Scalar::is_zero)))
        .collect();
    let excluded = (0..system.outputs.len()).filter(|i| !proper.contains(i)).map(|i| system.outputs[i].clone());
    let decided = (!slow.states.is_empty()).then(|| structure(&slow).ok());
    let decided = decided.as_ref().map(Option::as_ref);
    let finite = |of: fn(&kardan_results::Structure) -> Option<bool>| decided.map_or(Some(true), |found| of(found?));
    let (normal_rank, zeros) = zeros(system).unzip();
    let found = DescriptorSystem {
        variables: system.states.len(),
        rank_of_e: exact_rank(&system.e),
        index: apart.index(),
        finite_eigenvalues: slow.states.len(),
        impulse_free: apart.index() <= 1,
        infinite_blocks: apart.blocks.clone(),
        controllability: verdicts(system, &apart, Side::Inputs, finite(|found| found.controllability())),
        observability: verdicts(system, &apart, Side::Outputs, finite(|found| found.observability())),
        definitions,
        improper_outputs: excluded.collect(),
        polynomial_part,
        normal_rank,
        zeros,
        orders_at_infinity: at_infinity(&slow, derivatives),
        proof: SeparatedPencil { pencil: pencil(system), left: texts(&apart.left), right: texts(&apart.right) },
    };
    let outputs = proper.iter().map(|&i| system.outputs[i].clone()).collect();
    let equivalent = LinearSystem { c: rows_of(&slow.c, &proper), d: rows_of(&slow.d, &proper), outputs, ..slow };
    Ok(DecomposedDescriptor { found, equivalent })
}

/// A state that is one of the variables has its name, another is defined by them: `z = L x`.
fn named(reading: &Matrix<Rational>, variables: &[String]) -> (Vec<String>, Vec<Definition>) {
    let mut definitions = Vec::new();
    let name = |k: usize| {
        let terms = variables.iter().cloned().zip(reading.row(k).iter().cloned());
        let terms: Vec<(String, Rational)> = terms.filter(|(_, x)| !x.is_zero()).collect();
        match terms.as_slice() {
            [(name, factor)] if *factor == Rational::ONE => name.clone(),
            _ => {
                let free = (k + 1..).map(|number| format!("z{number}")).find(|name| !variables.contains(name));
                let state = free.unwrap_or_default();
                definitions.push(Definition { state: state.clone(), expression: plain_combination(&terms) });
                state
            }
        }
    };
    let states = (0..reading.rows()).map(name).collect();
    (states, definitions)
}

/// The entries of `P₁ s + P₂ s² + …`.
fn improper(derivatives: &[Matrix<Rational>], system: &LinearSystem) -> Vec<ImproperEntry> {
    let mut all = Vec::new();
    for (i, output) in system.outputs.iter().enumerate() {
        for (j, input) in system.inputs.iter().enumerate() {
            let of_powers = derivatives.iter().map(|matrix| matrix[(i, j)].clone());
            let polynomial = Polynomial::new([Rational::ZERO].into_iter().chain(of_powers).collect());
            if !polynomial.is_zero() {
                let polynomial = polynomial.to_string();
                all.push(ImproperEntry { output: output.clone(), input: input.clone(), polynomial });
            }
        }
    }
    all
}

/// Normal rank of the transfer matrix and its finite invariant zeros; `None` if they are not decided.
///
/// With regular P and Q such that `P E Q = diag(I, 0)` the variables that E leaves out are inputs without a name, and the equations
/// without derivatives outputs that are zero: the system matrix is that of a plain state space.
fn zeros(system: &LinearSystem) -> Option<(usize, PolynomialRoots)> {
    let (rank, plain) = separation::split_by_e(system);
    let algebraic = system.states.len() - rank;
    if rank == 0 {
        let none = PolynomialRoots { polynomial: "1".into(), values: Vec::new() };
        return Some((exact_rank(&plain.d) - algebraic, none));
    }
    let found = structure(&plain).ok()?.zeros;
    Some((found.normal_rank - algebraic, described_zeros(&found)))
}

/// Orders at infinity of `C (sI − J)⁻¹ B + P₀ + P₁ s + … + Pₖ sᵏ`: those of the same behind k integrators of each input, less k.
fn at_infinity(slow: &LinearSystem, derivatives: &[Matrix<Rational>]) -> Option<Vec<i64>> {
    let highest = derivatives.iter().rposition(|matrix| matrix.as_slice().iter().any(|x| !x.is_zero()));
    let k = highest.map_or(0, |last| last + 1);
    let (n, m) = (slow.states.len(), slow.inputs.len());
    if n + k * m == 0 || m == 0 || slow.outputs.is_empty() {
        return Some(Vec::new());
    }
    let power = |i: usize| if i == 0 { &slow.d } else { &derivatives[i - 1] };
    let chain = match k.checked_sub(1) {
        None => slow.clone(),
        Some(before) => {
            // The j-th integrals of the inputs are the states n + (j − 1) m, …; of them the last ones enter the system.
            let shift = Matrix::from_fn(k * m, k * m, |i, j| if i == j + m { Rational::ONE } else { Rational::ZERO });
            let entry = side_by_side(&[&Matrix::zeros(n, before * m), &slow.b]);
            let a = joined([&slow.a, &entry], [&Matrix::zeros(k * m, n), &shift]);
            let b = stacked(&[&Matrix::zeros(n, m), &Matrix::identity(m), &Matrix::zeros(before * m, m)]);
            let c = (0..k).rev().fold(slow.c.clone(), |all, i| side_by_side(&[&all, power(i)]));
            LinearSystem { d: power(k).clone(), ..LinearSystem::state_space(a, b, c) }
        }
    };
    let orders = orders_at_infinity(&chain, true)?;
    let shifted = orders.into_iter().map(|order| i64::try_from(order).unwrap_or(i64::MAX) - k as i64);
    Some(shifted.filter(|order| *order != 0).collect())
}
