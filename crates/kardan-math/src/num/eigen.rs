//! Eigenvalues of a real matrix.

use kardan_rt::functions::hypot;

use super::{Matrix, balance, isolated};

/// The eigenvalues of a real square matrix as `(real, imaginary)`, sorted by size, then by imaginary part.
///
/// Method: isolated states have theirs on the diagonal ([`isolated()`]); the others by QR iteration (`faer`) in balanced coordinates, O(n³),
/// backward stable there: errors of a few ulp of the balanced norm, more for nearly multiple eigenvalues. Returns `None` if the iteration does not converge or an entry is not finite.
///
/// ```
/// use kardan_math::num::{Matrix, eigenvalues};
/// let oscillator = [[0.0, 1.0], [-4.0, 0.0]];
/// let poles = eigenvalues(&Matrix::from_fn(2, 2, |i, j| oscillator[i][j])).unwrap();
/// assert!((poles[1].1 - 2.0).abs() < 1e-14 && poles[1].0.abs() < 1e-14);
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn eigenvalues(matrix: &Matrix<f64>) -> Option<Vec<(f64, f64)>> {
    assert_eq!(matrix.rows(), matrix.columns(), "eigenvalues of a matrix that is not square");
    if matrix.as_slice().iter().any(|x| !x.is_finite()) {
        return None;
    }
    let [isolated, coupled] = isolated(matrix);
    let mut values: Vec<(f64, f64)> = isolated.into_iter().map(|k| (matrix[(k, k)], 0.0)).collect();
    if !coupled.is_empty() {
        let m = faer::Mat::from_fn(coupled.len(), coupled.len(), |i, j| matrix[(coupled[i], coupled[j])]);
        let scales = balance(&m);
        let m = faer::Mat::from_fn(coupled.len(), coupled.len(), |i, j| m[(i, j)] * scales[j] / scales[i]);
        values.extend(m.eigenvalues().ok()?.into_iter().map(|z| (z.re, z.im)));
    }
    values.sort_by(|a, b| hypot(a.0, a.1).total_cmp(&hypot(b.0, b.1)).then(a.1.total_cmp(&b.1)));
    Some(values)
}
