//! The continuous linear quadratic regulator.

use faer::Mat;

use super::floating::{from_faer, to_faer};
use super::riccati::riccati;
use super::{Unreached, lyapunov, unreached};
use crate::matrix_parts::{exactly, is_finite};
use crate::notation::{format_poles, linear_combination};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Definiteness, Matrix, Rational, definiteness, eigenvalues};
use kardan_results::Pole;

/// The cost `∫ xᵀQx + 2xᵀNu + uᵀRu dt`.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights {
    /// Q, states × states, symmetric; `[Q N; Nᵀ R]` positive semidefinite.
    pub state: Matrix<f64>,
    /// R, inputs × inputs, symmetric, positive definite.
    pub input: Matrix<f64>,
    /// N, states × inputs; `None`: zero.
    pub cross: Option<Matrix<f64>>,
}

impl Weights {
    /// Diagonal weights: one per state, one per input.
    pub fn diagonal(state: &[f64], input: &[f64]) -> Self {
        let matrix = |d: &[f64]| Matrix::from_fn(d.len(), d.len(), |i, j| if i == j { d[i] } else { 0.0 });
        Self { state: matrix(state), input: matrix(input), cross: None }
    }
}

/// An optimal state feedback `u = −Kx`.
#[derive(Debug, Clone, PartialEq)]
pub struct Regulator {
    /// K = R⁻¹(BᵀX + Nᵀ), inputs × states.
    pub gain: Matrix<f64>,
    /// X, symmetric positive semidefinite: `xᵀXx` is the least cost from the state x on.
    pub solution: Matrix<f64>,
    /// Eigenvalues of A − BK, 1/s, by size.
    pub poles: Vec<Pole>,
    /// Certificate: norm of `AᵀX + XA + Q − (XB + N)R⁻¹(XB + N)ᵀ` over the sum of the norms of its terms, in balanced
    /// coordinates.
    pub residual: f64,
}

/// Why there is no optimal feedback.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RiccatiError {
    /// A weight has the wrong shape.
    #[error("the weight of the {what} is {} × {}; it must be {} × {}", actual.0, actual.1, expected.0, expected.1)]
    Shape {
        /// Which weight.
        what: &'static str,
        /// Its rows and columns.
        actual: (usize, usize),
        /// The required rows and columns.
        expected: (usize, usize),
    },
    /// A number is not finite.
    #[error("a number of the {0} is not finite")]
    NotFinite(&'static str),
    /// A weight is not symmetric.
    #[error("the weight of the {0} is not symmetric")]
    NotSymmetric(&'static str),
    /// R is not positive definite.
    #[error("the weight of the inputs is not positive definite: {direction} has a cost of zero or less")]
    InputWeight {
        /// Inputs uᵀRu ≤ 0, as text.
        direction: String,
    },
    /// `Q − N R⁻¹ Nᵀ` is not positive semidefinite.
    #[error("the weight of the states is not positive semidefinite: along {direction} it is {value:e}")]
    StateWeight {
        /// The state x of unit length, as text.
        direction: String,
        /// xᵀ(Q − N R⁻¹ Nᵀ)x < 0.
        value: f64,
    },
    /// E is singular.
    #[error("the matrix E is singular")]
    Singular,
    /// Modes that are not stable and that no input reaches.
    #[error("not stabilisable: no input reaches the modes {} of {}", format_poles(modes), combinations.join("; "))]
    NotStabilisable {
        /// The modes that no input reaches and that do not decay, 1/s.
        modes: Vec<Pole>,
        /// Combinations of states that no input reaches.
        combinations: Vec<String>,
    },
    /// Modes on the imaginary axis without cost: the optimal feedback would not move them.
    #[error("the modes {} of {} have no cost and do not decay", format_poles(modes), motions.join("; "))]
    NotDetectable {
        /// The modes, 1/s.
        modes: Vec<Pole>,
        /// Motions without cost, as text.
        motions: Vec<String>,
    },
    /// Floating point found no stabilising solution.
    #[error(
        "the solver finds no stabilising solution: modes are too close to ones that no input reaches or that have no cost"
    )]
    NotSolved,
}

/// The feedback `u = −Kx` that minimises the cost for `E ẋ = A x + B u`; its dual is [`kalman`](super::super::observer::kalman).
///
/// Stabilisability and what the cost does not see are decided exactly on the system's fractions and the exact values of the
/// weights; the Riccati equation is solved by the stable invariant subspace of the Hamiltonian matrix (ordered Schur form)
/// and refined by steps of Newton and Kleinman. Cost about 1000 n³ flops.
///
/// # Errors
/// See [`RiccatiError`]. Semidefiniteness is tested with a tolerance of `1e-12` for weights scaled to a unit diagonal.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::regulator::{Weights, lqr};
/// // A double integrator: K = [1, √3].
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(matrix(&[&[0, 1], &[0, 0]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0]]));
/// let regulator = lqr(&system, &Weights::diagonal(&[1.0, 1.0], &[1.0])).unwrap();
/// assert!((regulator.gain[(0, 1)] - 3f64.sqrt()).abs() < 1e-14 && regulator.residual < 1e-15);
/// ```
pub fn lqr(system: &LinearSystem, weights: &Weights) -> Result<Regulator, RiccatiError> {
    let (n, m) = (system.states.len(), system.inputs.len());
    let cross = weights.cross.clone().unwrap_or_else(|| Matrix::zeros(n, m));
    check("states", &weights.state, (n, n))?;
    check("inputs", &weights.input, (m, m))?;
    check("products of states and inputs", &cross, (n, m))?;
    let q = symmetrised("states", &weights.state)?;
    let r = symmetrised("inputs", &weights.input)?;
    if let Definiteness::PositiveSemi { direction } | Definiteness::Indefinite { witness: direction } =
        definiteness(&exactly(&r))
    {
        return Err(RiccatiError::InputWeight { direction: linear_combination(&system.inputs, &direction) });
    }
    let explicit = system.explicit().ok_or(RiccatiError::Singular)?;
    let through = exactly(&r).solve(&exactly(&cross).transpose()).ok_or(RiccatiError::NotSolved)?;
    let cost = exactly(&q).minus(&exactly(&cross).multiply(&through));
    semidefinite(&system.states, &to_faer(&cost.to_f64()))?;
    // The modes are roots with proven signs.
    if let Some(part) = unreached(&explicit) {
        let modes: Vec<Pole> = part.modes.iter().copied().filter(|mode| mode.re >= 0.0).collect();
        if !modes.is_empty() {
            return Err(RiccatiError::NotStabilisable { modes, combinations: part.combinations });
        }
    }
    if let Some(part) = unobservable(&explicit, &through, &cost) {
        let modes: Vec<Pole> = part.modes.iter().copied().filter(|mode| mode.re == 0.0).collect();
        if !modes.is_empty() {
            return Err(RiccatiError::NotDetectable { modes, motions: part.combinations });
        }
    }
    let (a, b) = (explicit.a.to_f64(), explicit.b.to_f64());
    if !(is_finite(&a) && is_finite(&b)) {
        return Err(RiccatiError::NotFinite("system"));
    }
    if n == 0 || m == 0 {
        return uncontrolled_regulator(&a, &q, m);
    }
    let found = riccati(&to_faer(&a), &to_faer(&b), &to_faer(&q), &to_faer(&r), &to_faer(&cross));
    let found = found.filter(|found| found.residual < 1e-6).ok_or(RiccatiError::NotSolved)?;
    let (gain, solution) = (from_faer(&found.gain), from_faer(&found.x));
    let closed = a.minus(&b.multiply(&gain));
    let poles = balanced_eigenvalues(&closed).ok_or(RiccatiError::NotSolved)?;
    if poles.iter().any(|pole| !(pole.re < 0.0)) {
        return Err(RiccatiError::NotSolved);
    }
    Ok(Regulator { gain, solution, poles, residual: found.residual })
}

/// Without inputs the cost of a stable system follows from a Lyapunov equation.
fn uncontrolled_regulator(a: &Matrix<f64>, q: &Matrix<f64>, inputs: usize) -> Result<Regulator, RiccatiError> {
    let found = lyapunov(&a.transpose(), q).map_err(|_| RiccatiError::NotSolved)?;
    Ok(Regulator {
        gain: Matrix::zeros(inputs, a.rows()),
        solution: found.solution,
        poles: balanced_eigenvalues(a).ok_or(RiccatiError::NotSolved)?,
        residual: found.residual,
    })
}

/// The eigenvalues, found in balanced coordinates.
pub(super) fn balanced_eigenvalues(a: &Matrix<f64>) -> Option<Vec<Pole>> {
    if a.rows() == 0 {
        return Some(Vec::new());
    }
    if !is_finite(a) {
        return None;
    }
    let s = kardan_math::num::balance(&to_faer(a));
    eigenvalues(&Matrix::from_fn(a.rows(), a.rows(), |i, j| a[(i, j)] * s[j] / s[i])).map(Pole::list)
}

fn check(what: &'static str, m: &Matrix<f64>, expected: (usize, usize)) -> Result<(), RiccatiError> {
    let actual = (m.rows(), m.columns());
    if actual != expected {
        return Err(RiccatiError::Shape { what, actual, expected });
    }
    if is_finite(m) { Ok(()) } else { Err(RiccatiError::NotFinite(what)) }
}

fn symmetrised(what: &'static str, m: &Matrix<f64>) -> Result<Matrix<f64>, RiccatiError> {
    let n = m.rows();
    for i in 0..n {
        for j in 0..i {
            let size = (m[(i, i)] * m[(j, j)]).abs().sqrt().max(m[(i, j)].abs()).max(m[(j, i)].abs());
            if (m[(i, j)] - m[(j, i)]).abs() > 1e-12 * size {
                return Err(RiccatiError::NotSymmetric(what));
            }
        }
    }
    Ok(Matrix::from_fn(n, n, |i, j| 0.5 * m[(i, j)] + 0.5 * m[(j, i)]))
}

fn semidefinite(states: &[String], cost: &Mat<f64>) -> Result<(), RiccatiError> {
    let n = cost.nrows();
    if n == 0 {
        return Ok(());
    }
    let largest = cost.norm_max();
    let unit = |i: usize| if cost[(i, i)].abs() > 0.0 { cost[(i, i)].abs().sqrt() } else { largest.sqrt().max(1e-150) };
    let sizes: Vec<f64> = (0..n).map(unit).collect();
    let scaled = Mat::from_fn(n, n, |i, j| cost[(i, j)] / sizes[i] / sizes[j]);
    let Ok(eigen) = scaled.self_adjoint_eigen(faer::Side::Lower) else {
        return Err(RiccatiError::NotFinite("states"));
    };
    let Some((k, lowest)) = (0..n).map(|k| (k, eigen.S()[k])).min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(()) };
    if lowest >= -1e-12 {
        return Ok(());
    }
    let x: Vec<f64> = (0..n).map(|i| eigen.U()[(i, k)] / sizes[i]).collect();
    let length = x.iter().map(|x| x * x).sum::<f64>().sqrt();
    let named = |(name, x): (&String, &f64)| (x.abs() > 1e-6 * length).then(|| format!("{:.3} {name}", x / length));
    let direction = states.iter().zip(&x).filter_map(named).collect::<Vec<_>>().join(" + ");
    Err(RiccatiError::StateWeight { direction, value: lowest / length / length })
}

/// The part of `ẋ = (A − B R⁻¹ Nᵀ) x` that the cost `xᵀ(Q − N R⁻¹ Nᵀ)x` does not see.
fn unobservable(explicit: &LinearSystem, through: &Matrix<Rational>, cost: &Matrix<Rational>) -> Option<Unreached> {
    let a = explicit.a.minus(&explicit.b.multiply(through));
    let dual = LinearSystem::state_space(a.transpose(), cost.transpose(), Matrix::zeros(0, a.rows()));
    unreached(&LinearSystem { states: explicit.states.clone(), ..dual })
}
