//! Converts matrices for floating-point decompositions.

use faer::Mat;

use kardan_math::num::Matrix;

/// For `faer`.
pub(super) fn to_faer(m: &Matrix<f64>) -> Mat<f64> {
    Mat::from_fn(m.rows(), m.columns(), |i, j| m[(i, j)])
}

/// From `faer`.
pub(super) fn from_faer(m: &Mat<f64>) -> Matrix<f64> {
    Matrix::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)])
}

/// `diag(1/rows) M diag(columns)`.
pub(super) fn scaled(m: &Mat<f64>, rows: &[f64], columns: &[f64]) -> Mat<f64> {
    Mat::from_fn(m.nrows(), m.ncols(), |i, j| m[(i, j)] * columns[j] / rows[i])
}

/// `(M + Mᵀ)/2`.
pub(super) fn symmetric(m: &Mat<f64>) -> Mat<f64> {
    faer::Scale(0.5) * (m + m.transpose())
}
