//! Extends a system by constant disturbances as states.

use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational};

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
    let zero = || Rational::ZERO;
    let unit = |i: usize, j: usize| if i == j { Rational::ONE } else { Rational::ZERO };
    LinearSystem {
        states: system.states.iter().chain(names).cloned().collect(),
        inputs: system.inputs.clone(),
        outputs: system.outputs.clone(),
        e: Matrix::from_fn(n + k, n + k, |i, j| if i < n && j < n { system.e[(i, j)].clone() } else { unit(i, j) }),
        a: Matrix::from_fn(n + k, n + k, |i, j| match (i < n, j < n) {
            (true, true) => system.a[(i, j)].clone(),
            (true, false) => disturbance[(i, j - n)].clone(),
            _ => zero(),
        }),
        b: Matrix::from_fn(n + k, system.inputs.len(), |i, j| if i < n { system.b[(i, j)].clone() } else { zero() }),
        c: Matrix::from_fn(system.outputs.len(), n + k, |i, j| if j < n { system.c[(i, j)].clone() } else { zero() }),
        d: system.d.clone(),
        degrees_of_freedom: None,
    }
}
