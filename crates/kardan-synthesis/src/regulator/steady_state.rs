//! States and inputs at which outputs rest at required values.

use crate::matrix_parts::{joined, stacked, window};
use crate::notation::linear_combination;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, Scalar, reduced_form};

/// States and inputs at which the outputs rest at given values, exact: `x = N_x r`, `u = N_u r`.
#[derive(Debug, Clone, PartialEq)]
pub struct SteadyState {
    /// N_x, states × outputs.
    pub states: Matrix<Rational>,
    /// N_u, inputs × outputs.
    pub inputs: Matrix<Rational>,
}

/// Why no values of the outputs can be kept constant.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SteadyStateError {
    /// There are not as many outputs as inputs.
    #[error("{outputs} outputs cannot be held constant by {inputs} inputs; as many inputs as outputs are needed")]
    NotSquare {
        /// Their number.
        outputs: usize,
        /// Their number.
        inputs: usize,
    },
    /// The system has an invariant zero at s = 0.
    #[error("the system has a zero at s = 0: {unheld}")]
    Zero {
        /// The combinations of outputs that cannot be kept constant, or the equilibria that no output shows, as text.
        unheld: String,
    },
}

impl SteadyState {
    /// L of `u = −Kx + Lr` that gives `y = r` at rest: `L = N_u + K N_x`, inputs × outputs.
    ///
    /// The same as `(D − (C − DK)(A − BK)⁻¹B)⁻¹`. The loop must be stable for it to come to rest there.
    ///
    /// # Panics
    /// If K is not inputs × states.
    pub fn reference_gain(&self, gain: &Matrix<f64>) -> Matrix<f64> {
        self.inputs.to_f64().plus(&gain.multiply(&self.states.to_f64()))
    }
}

/// The equilibrium of `E ẋ = A x + B u`, `y = C x + D u` with y = r: `[A B; C D] [N_x; N_u] = [0; I]`, exact, for any feedback.
///
/// # Errors
/// If there is an invariant zero at s = 0 (that matrix is singular), or not as many outputs as inputs.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::regulator::steady_state;
/// // A motor on a spring of 100 N m/rad, inertia 1 kg m²: holding an angle r needs the torque 100 r.
/// let m = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let system = LinearSystem::state_space(m(&[&[0, 1], &[-100, 0]]), m(&[&[0], &[1]]), m(&[&[1, 0]]));
/// let rest = steady_state(&system).unwrap();
/// assert_eq!((&rest.states, &rest.inputs), (&m(&[&[1], &[0]]), &m(&[&[100]])));
/// // u = −2x₁ − 3x₂ + 102 r
/// assert_eq!(rest.reference_gain(&Matrix::from_fn(1, 2, |_, j| [2.0, 3.0][j]))[(0, 0)], 102.0);
/// ```
pub fn steady_state(system: &LinearSystem) -> Result<SteadyState, SteadyStateError> {
    let (n, m, p) = (system.states.len(), system.inputs.len(), system.outputs.len());
    if m != p {
        return Err(SteadyStateError::NotSquare { outputs: p, inputs: m });
    }
    let whole = joined([&system.a, &system.b], [&system.c, &system.d]);
    let right = stacked(&[&Matrix::zeros(n, p), &Matrix::identity(p)]);
    let Some(solution) = whole.solve(&right) else {
        return Err(SteadyStateError::Zero { unheld: reason(system, &whole) });
    };
    Ok(SteadyState { states: window(&solution, 0..n, 0..p), inputs: window(&solution, n..n + m, 0..p) })
}

/// A left null vector of `[A B; C D]` as text.
fn reason(system: &LinearSystem, whole: &Matrix<Rational>) -> String {
    let n = system.states.len();
    let e = reduced_form(whole);
    let rows = (e.rank()..whole.rows()).map(|i| e.transform.row(i)[n..].to_vec());
    let outputs: Vec<String> = rows
        .filter(|row| row.iter().any(|x| !x.is_zero()))
        .map(|row| {
            let first = row.iter().find(|x| !x.is_zero()).cloned().unwrap_or(Rational::ONE);
            linear_combination(&system.outputs, &row.iter().map(|x| x.over(&first)).collect::<Vec<_>>())
        })
        .collect();
    if outputs.is_empty() {
        // ℓA = 0, ℓB = 0: ℓEx never changes.
        let unreachable: Vec<String> = (e.rank()..whole.rows())
            .map(|i| {
                let row = Matrix::from_fn(1, n, |_, j| e.transform[(i, j)].clone());
                format!("{} never changes", linear_combination(&system.states, row.multiply(&system.e).as_slice()))
            })
            .collect();
        return unreachable.join("; ");
    }
    let list: Vec<String> = outputs.iter().map(|notation| format!("{notation} is zero at every equilibrium")).collect();
    list.join("; ")
}
