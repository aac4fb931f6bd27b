//! Balances the rows and columns of a square matrix.

use faer::Mat;
use kardan_rt::functions::{exp2, log2};

use super::Matrix;

/// Scales of the coordinates that balance rows and columns of a square matrix: `A[i][j] · s[j] / s[i]`.
///
/// Powers of two, so that scaling has no rounding errors. Method: Parlett and Reinsch, without permutations; a stiff mechanical model in
/// SI units loses several digits without it.
///
/// # Panics
/// If the matrix is not square.
pub fn balance(matrix: &Mat<f64>) -> Vec<f64> {
    let n = matrix.nrows();
    assert_eq!(n, matrix.ncols(), "balancing a matrix that is not square");
    let mut columns: Vec<Vec<f64>> = (0..n).map(|k| (0..n).map(|i| matrix[(i, k)]).collect()).collect();
    let mut rows: Vec<Vec<f64>> = (0..n).map(|k| (0..n).map(|j| matrix[(k, j)]).collect()).collect();
    let mut scales = vec![1.0; n];
    for _ in 0..20 {
        let mut changed = false;
        for k in 0..n {
            let off_diagonal = |line: &[f64]| line[..k].iter().chain(&line[k + 1..]).map(|x| x.abs()).sum::<f64>();
            let (column, row) = (off_diagonal(&columns[k]), off_diagonal(&rows[k]));
            if !(column > 0.0 && row > 0.0 && column.is_finite() && row.is_finite()) {
                continue;
            }
            // No power of two balances these better by as much as is required below.
            if (0.45..2.2).contains(&(row / column)) {
                continue;
            }
            let factor = exp2((0.5 * log2(row / column)).round());
            if column * factor + row / factor < 0.95 * (column + row) {
                changed = true;
                scales[k] *= factor;
                for i in 0..n {
                    columns[k][i] *= factor;
                    rows[i][k] *= factor;
                }
                for j in 0..n {
                    columns[j][k] /= factor;
                    rows[k][j] /= factor;
                }
            }
        }
        if !changed {
            break;
        }
    }
    scales
}

/// The matrix in coordinates of these scales: `A[i][j] · s[j] / s[i]`.
pub fn scaled(matrix: &Matrix<f64>, scales: &[f64]) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)] * scales[j] / scales[i])
}

/// The matrix from one in coordinates of these scales.
pub fn unscaled(matrix: &Matrix<f64>, scales: &[f64]) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)] * scales[i] / scales[j])
}
