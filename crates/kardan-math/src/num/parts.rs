//! Parts of matrices, and matrices that are made of parts.

use std::ops::Range;

use super::{Matrix, Scalar};

/// Matrices with the same number of rows, beside each other.
pub fn side_by_side<S: Scalar>(parts: &[&Matrix<S>]) -> Matrix<S> {
    let rows = parts.first().map_or(0, |part| part.rows());
    let columns = parts.iter().map(|part| part.columns()).sum();
    let mut out = Matrix::zeros(rows, columns);
    let mut first = 0;
    for part in parts {
        for i in 0..rows {
            out.row_mut(i)[first..first + part.columns()].clone_from_slice(part.row(i));
        }
        first += part.columns();
    }
    out
}

/// Vertical concatenation of matrices with the same number of columns.
pub fn stacked<S: Scalar>(parts: &[&Matrix<S>]) -> Matrix<S> {
    let columns = parts.iter().map(|part| part.columns()).max().unwrap_or(0);
    let rows: Vec<&[S]> = parts.iter().flat_map(|part| (0..part.rows()).map(move |i| part.row(i))).collect();
    Matrix::from_fn(rows.len(), columns, |i, j| rows[i][j].clone())
}

/// `[a b; c d]`.
pub fn joined<S: Scalar>([a, b]: [&Matrix<S>; 2], [c, d]: [&Matrix<S>; 2]) -> Matrix<S> {
    stacked(&[&side_by_side(&[a, b]), &side_by_side(&[c, d])])
}

/// Some rows and columns.
pub fn selected<S: Scalar>(matrix: &Matrix<S>, rows: &[usize], columns: &[usize]) -> Matrix<S> {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])].clone())
}

/// Some rows.
pub fn rows_of<S: Scalar>(matrix: &Matrix<S>, rows: &[usize]) -> Matrix<S> {
    Matrix::from_fn(rows.len(), matrix.columns(), |i, j| matrix[(rows[i], j)].clone())
}

/// Some columns.
pub fn columns_of<S: Scalar>(matrix: &Matrix<S>, columns: &[usize]) -> Matrix<S> {
    Matrix::from_fn(matrix.rows(), columns.len(), |i, j| matrix[(i, columns[j])].clone())
}

/// Rows and columns that follow each other.
pub fn window<S: Scalar>(matrix: &Matrix<S>, rows: Range<usize>, columns: Range<usize>) -> Matrix<S> {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows.start + i, columns.start + j)].clone())
}
