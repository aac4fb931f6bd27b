//! Relative degrees of outputs.

use super::rows::row_times;
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, Scalar};

/// The relative degree of each output \[diss. (6.64)-(6.66), (6.70)\].
#[derive(Debug, Clone, PartialEq)]
pub struct RelativeDegrees {
    /// r_i: derivatives of output i until an input appears; 0 with feedthrough, `None` if no input ever reaches it.
    pub degrees: Vec<Option<usize>>,
    /// The decoupling matrix G, outputs × inputs: rows `C_i A^(r_i−1) B`, or D_i for degree 0; zeros for `None`.
    pub matrix: Matrix<Rational>,
    /// A*, outputs × states: rows `C_i A^r_i`, hence C_i for degree 0; zeros for `None`.
    pub free: Matrix<Rational>,
}

/// Relative degrees, decoupling matrix and free motion of the outputs: `y_i^(r_i) = A*_i x + G_i u` \[diss. (6.64)-(6.70)\].
///
/// Unlike the source, an output that no input reaches has no relative degree (there r_i = n) and an output with
/// feedthrough has degree 0. Exact; cost outputs · n³ rational operations at most.
///
/// ```
/// use kardan_analysis::LinearSystem;
/// use kardan_math::num::{Matrix, Rational};
/// use kardan_synthesis::decoupling::relative_degrees;
/// let matrix = |rows: &[&[i64]]| Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]));
/// // A body of 1 kg m²: the torque acts on the second derivative of its angle.
/// let body = LinearSystem::state_space(matrix(&[&[0, 1], &[-3, -2]]), matrix(&[&[0], &[1]]), matrix(&[&[1, 0]]));
/// let degrees = relative_degrees(&body);
/// assert_eq!(degrees.degrees, [Some(2)]);
/// assert_eq!(degrees.free, matrix(&[&[-3, -2]]));
/// ```
///
/// # Panics
/// If E is not the identity ([`LinearSystem::explicit`] makes it so).
pub fn relative_degrees(system: &LinearSystem) -> RelativeDegrees {
    assert_explicit(system);
    let (n, outputs, inputs) = (system.states.len(), system.outputs.len(), system.inputs.len());
    let mut matrix = Matrix::<Rational>::zeros(outputs, inputs);
    let mut free = Matrix::<Rational>::zeros(outputs, n);
    let mut degrees = Vec::with_capacity(outputs);
    for i in 0..outputs {
        let mut row = system.c.row(i).to_vec();
        let mut reach = system.d.row(i).to_vec();
        let mut degree = 0;
        while reach.iter().all(Scalar::is_zero) && degree < n {
            degree += 1;
            reach = row_times(&row, &system.b);
            row = row_times(&row, &system.a);
        }
        if reach.iter().all(Scalar::is_zero) {
            degrees.push(None);
            continue;
        }
        matrix.row_mut(i).clone_from_slice(&reach);
        free.row_mut(i).clone_from_slice(&row);
        degrees.push(Some(degree));
    }
    RelativeDegrees { degrees, matrix, free }
}

/// `C_i, C_i A, …, C_i A^(count−1)`.
pub(super) fn chain(system: &LinearSystem, output: usize, count: usize) -> Vec<Vec<Rational>> {
    let first = system.c.row(output).to_vec();
    std::iter::successors(Some(first), |row| Some(row_times(row, &system.a))).take(count).collect()
}

pub(super) fn assert_explicit(system: &LinearSystem) {
    assert!(
        system.e == Matrix::identity(system.states.len()),
        "the system must have E = I; `LinearSystem::explicit` makes it so"
    );
}
