//! State feedback by pole placement.

use faer::Mat;
use kardan_rt::functions::{exp2, hypot, log2};

use super::assignment::{Assignment, assign};
use super::floating::{from_faer, scaled, to_faer};
use super::pole_list::{multiplicities, paired, take_nearest};
use super::quadratic::balanced_eigenvalues;
use super::single_input::single_input;
use super::{chains, unreached};
use crate::matrix_parts::{is_finite, spread};
use crate::notation::{format_pole, format_poles};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, balance, reduced_form};
use kardan_results::{Complex, Pole};

/// A state feedback `u = −Kx` with chosen poles.
#[derive(Debug, Clone, PartialEq)]
pub struct Placement {
    /// K, inputs × states.
    pub gain: Matrix<f64>,
    /// Eigenvalues of A − BK as they are found, 1/s, by size.
    pub poles: Vec<Pole>,
    /// Certificate: largest distance of an eigenvalue from its requested pole, relative to the size of the pole; poles below 1e-3 of
    /// the largest one count as that large.
    pub residual: f64,
    /// Condition number of the eigenvectors of the reached part, in balanced coordinates: how much the poles move with
    /// errors of A − BK there. Infinite if they are numerically dependent.
    pub condition: f64,
}

/// Why poles cannot be placed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlacementError {
    /// A number is not finite.
    #[error("a number is not finite")]
    NotFinite,
    /// Not as many poles as states.
    #[error("{actual} poles for {states} states")]
    WrongNumber {
        /// How many are given.
        actual: usize,
        /// How many states there are.
        states: usize,
    },
    /// A complex pole without its conjugate.
    #[error("the pole {} and its conjugate must occur equally often", format_pole(pole))]
    NotSelfConjugate {
        /// The pole, 1/s.
        pole: Pole,
    },
    /// A pole more often than there are independent inputs.
    #[error(
        "the pole {} is requested {times} times; {rank} independent inputs allow at most {rank}",
        format_pole(pole)
    )]
    TooOften {
        /// The pole, 1/s.
        pole: Pole,
        /// The requested multiplicity.
        times: usize,
        /// Rank of B.
        rank: usize,
    },
    /// Repeated poles that the chains of the inputs allow only with dependent eigenvectors (Rosenbrock).
    #[error(
        "poles repeated that often need dependent eigenvectors: the {inputs} strongest inputs move chains of {needed} \
         states, but the request has only {actual} different poles in as many sets without repetition"
    )]
    Repeated {
        /// How many inputs.
        inputs: usize,
        /// Sum of their controllability indices.
        needed: usize,
        /// Poles in as many sets.
        actual: usize,
    },
    /// Modes that no input reaches are not among the poles.
    #[error(
        "no input reaches {}: the modes {} stay as they are (roots of {polynomial}) and must be among the poles",
        combinations.join("; "),
        format_poles(modes)
    )]
    FixedModes {
        /// The fixed modes, 1/s.
        modes: Vec<Pole>,
        /// Their exact polynomial.
        polynomial: String,
        /// Combinations of states that no input reaches, as text.
        combinations: Vec<String>,
    },
    /// E is singular.
    #[error("the matrix E is singular")]
    Singular,
    /// Floating point fails: the eigenvectors would be numerically dependent.
    #[error("the poles are too close to each other for the inputs: the eigenvectors are numerically dependent")]
    Dependent,
}

/// The feedback `u = −Kx` that gives `E ẋ = A x + B u` the poles given in 1/s, as insensitive to errors as sweeps can make it.
///
/// What can be placed is decided exactly: modes that no input reaches must be among the poles (within 1e-6 of their size);
/// repeated poles need independent inputs. Then eigenvectors are chosen for largest `|det X|` (Kautsky, Nichols and Van
/// Dooren 1985; Tits and Yang 1996) in coordinates in which the closed loop is balanced, and `K = B⁺(A − XΛX⁻¹)`; a single
/// input leaves no choice, its gain is computed exactly and rounded once. Cost some 30 n⁴ flops for each sweep.
///
/// # Errors
/// See [`PlacementError`].
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::regulator::place_poles;
/// // A double integrator with the poles −2 ± 3j: s² + 4s + 13.
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0]]));
/// let placement = place_poles(&system, &[(-2.0, 3.0).into(), (-2.0, -3.0).into()]).unwrap();
/// assert!((placement.gain[(0, 0)] - 13.0).abs() < 1e-12 && (placement.gain[(0, 1)] - 4.0).abs() < 1e-12);
/// ```
pub fn place_poles(system: &LinearSystem, poles: &[Pole]) -> Result<Placement, PlacementError> {
    let n = system.states.len();
    if poles.len() != n {
        return Err(PlacementError::WrongNumber { actual: poles.len(), states: n });
    }
    if poles.iter().any(|Complex { re, im }| !(re.is_finite() && im.is_finite())) {
        return Err(PlacementError::NotFinite);
    }
    paired(poles).map_err(|pole| PlacementError::NotSelfConjugate { pole })?;
    let explicit = system.explicit().ok_or(PlacementError::Singular)?;
    let mut free = poles.to_vec();
    let (a, b, reached) = match unreached(&explicit) {
        None => (explicit.a.clone(), explicit.b.clone(), (0..n).collect()),
        Some(part) => {
            let largest = poles.iter().map(|p| hypot(p.re, p.im)).fold(0.0, f64::max);
            let distances = take_nearest(&mut free, &part.modes);
            let near = |(mode, distance): (&Pole, &f64)| *distance <= 1e-6 * hypot(mode.re, mode.im) + 1e-9 * largest;
            if !part.modes.iter().zip(&distances).all(near) || paired(&free).is_err() {
                let polynomial = part.polynomial.to_string();
                let (modes, combinations) = (part.modes, part.combinations);
                return Err(PlacementError::FixedModes { modes, polynomial, combinations });
            }
            (part.a, part.b, part.reached)
        }
    };
    let rank = check_repetitions(&a, &b, &free)?;
    let single = (rank == 1 && a.rows() <= MOST_EXACT).then(|| single_input(&a, &b, &free)).flatten();
    let chosen = eigenvectors(&a, &b, rank, &free)?;
    let condition = chosen.as_ref().map_or(f64::INFINITY, |chosen| chosen.condition);
    let inner = single.or(chosen.map(|chosen| from_faer(&chosen.gain))).ok_or(PlacementError::Dependent)?;
    let gain = spread(&inner, &reached, n);
    let closed = explicit.a.to_f64().minus(&explicit.b.to_f64().multiply(&gain));
    let achieved = balanced_eigenvalues(&closed).ok_or(PlacementError::Dependent)?;
    Ok(Placement { residual: mismatch(&achieved, poles), gain, poles: achieved, condition })
}

/// Largest number of states for which a single input is treated exactly.
const MOST_EXACT: usize = 32;

/// The gain whose eigenvectors are the most independent ones found, in three systems of coordinates; `None` if they are
/// numerically dependent in all.
fn eigenvectors(
    a: &Matrix<Rational>,
    b: &Matrix<Rational>,
    rank: usize,
    poles: &[Pole],
) -> Result<Option<Assignment>, PlacementError> {
    let targets = paired(poles).map_err(|pole| PlacementError::NotSelfConjugate { pole })?;
    let (a, b) = (a.to_f64(), b.to_f64());
    if !(is_finite(&a) && is_finite(&b)) {
        return Err(PlacementError::NotFinite);
    }
    let (a, b) = (to_faer(&a), to_faer(&b));
    if a.nrows() == 0 {
        return Ok(Some(Assignment { gain: Mat::zeros(b.ncols(), 0), condition: 1.0 }));
    }
    let mut best: Option<Assignment> = None;
    let mut scales = balance(&a);
    for _ in 0..3 {
        let inverse: Vec<f64> = scales.iter().map(|s| 1.0 / s).collect();
        let pushes = scaled(&b, &scales, &vec![1.0; b.ncols()]);
        let sizes: Vec<f64> = (0..b.ncols()).map(|j| 1.0 / size(&pushes, j)).collect();
        let pushes = scaled(&pushes, &vec![1.0; a.nrows()], &sizes);
        let Some(found) = assign(&scaled(&a, &scales, &scales), &pushes, rank, &targets) else { break };
        let gain = Mat::from_fn(b.ncols(), a.nrows(), |i, j| found.gain[(i, j)] * sizes[i] * inverse[j]);
        // The next round is balanced for the closed loop.
        scales = balance(&(&a - &b * &gain));
        if best.as_ref().is_none_or(|best| found.condition < best.condition) {
            best = Some(Assignment { gain, ..found });
        }
    }
    Ok(best)
}

/// Largest distance of an achieved pole from the requested one, relative to that.
fn mismatch(achieved: &[Pole], requested: &[Pole]) -> f64 {
    let size = |p: &Pole| hypot(p.re, p.im);
    let largest = requested.iter().map(size).fold(0.0, f64::max);
    let distances = take_nearest(&mut achieved.to_vec(), requested);
    let relative = |(d, target): (f64, &Pole)| if d > 0.0 { d / size(target).max(1e-3 * largest) } else { 0.0 };
    distances.into_iter().zip(requested).map(relative).fold(0.0, f64::max)
}

/// The exact rank of B; repeated poles must be possible with independent eigenvectors.
///
/// The invariant polynomials of A − BK can have the degrees d₁ ≥ d₂ ≥ … if and only if `d₁ + … + d_k ≥ κ₁ + … + κ_k` for
/// all k, with the controllability indices κ in descending order (Rosenbrock 1970). Without Jordan blocks d_k is the number of
/// poles of multiplicity ≥ k.
fn check_repetitions(a: &Matrix<Rational>, b: &Matrix<Rational>, poles: &[Pole]) -> Result<usize, PlacementError> {
    let rank = reduced_form(b).rank();
    let repeated = multiplicities(poles);
    if let Some(&(pole, times)) = repeated.iter().find(|(_, times)| *times > rank) {
        return Err(PlacementError::TooOften { pole, times, rank });
    }
    if repeated.len() < poles.len() {
        let mut indices = chains(a, b).indices;
        indices.sort_by(|x, y| y.cmp(x));
        let (mut needed, mut actual) = (0, 0);
        for (k, index) in indices.iter().enumerate() {
            needed += index;
            actual += repeated.iter().filter(|(_, times)| *times > k).count();
            if actual < needed {
                return Err(PlacementError::Repeated { inputs: k + 1, needed, actual });
            }
        }
    }
    Ok(rank)
}

/// A power of two near the length of a column; one for a column of zeros.
fn size(m: &Mat<f64>, column: usize) -> f64 {
    let length = m.col(column).norm_l2();
    if length > 0.0 { exp2(log2(length).round()) } else { 1.0 }
}
