//! Extends a system by constant disturbances as states.

use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational};

use crate::matrix_parts::{joined, side_by_side, stacked};

/// The system with unknown constant disturbances as states: `E ẋ = A x + B u + W d`, `ḋ = 0` \[diss. (6.45)\], exact.
///
/// `disturbance` is W, states × disturbances; with the E of a mechanical model its lower half contains torques, as B does:
/// `[0; Kᵀ e_shaft]` for a torque on a shaft. The new states follow the others, with the names given; inputs and outputs stay.
///
/// # Panics
/// If W has not one row per state and one column per name.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::observer::extend;
/// let m = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// let body = LinearSystem::state_space(m(&[&[0, 1], &[0, 0]]), m(&[&[0], &[1]]), m(&[&[1, 0]]));
/// let extended = extend(&body, &m(&[&[0], &[1]]), &["load".to_string()]);
/// assert_eq!(extended.a, m(&[&[0, 1, 0], &[0, 0, 1], &[0, 0, 0]]));
/// assert_eq!(extended.states, ["x1", "x2", "load"]);
/// ```
pub fn extend(system: &LinearSystem, disturbance: &Matrix<Rational>, names: &[String]) -> LinearSystem {
    let (n, k) = (system.states.len(), names.len());
    assert!(disturbance.rows() == n && disturbance.columns() == k, "one row per state, one column per name");
    LinearSystem {
        states: system.states.iter().chain(names).cloned().collect(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        e: joined([&system.e, &Matrix::zeros(n, k)], [&Matrix::zeros(k, n), &Matrix::identity(k)]),
        a: joined([&system.a, disturbance], [&Matrix::zeros(k, n), &Matrix::zeros(k, k)]),
        b: stacked(&[&system.b, &Matrix::zeros(k, system.inputs.len())]),
        c: side_by_side(&[&system.c, &Matrix::zeros(system.outputs.len(), k)]),
        d: system.d.clone(),
        degrees_of_freedom: None,
    }
}
