//! Parts of matrices, matrices that are made of parts, and what their entries are.

use std::ops::Range;

use kardan_math::num::{Matrix, Rational, Scalar, rational_from_f64};

/// Horizontal concatenation of matrices with the same number of rows.
pub(super) fn side_by_side<S: Scalar>(parts: &[&Matrix<S>]) -> Matrix<S> {
    let rows = parts.first().map_or(0, |part| part.rows());
    let columns = parts.iter().map(|part| part.columns()).sum();
    let mut out = Matrix::zeros(rows, columns);
    let mut first = 0;
    for part in parts {
        for i in 0..rows {
            for j in 0..part.columns() {
                out[(i, first + j)] = part[(i, j)].clone();
            }
        }
        first += part.columns();
    }
    out
}

/// Vertical concatenation of matrices with the same number of columns.
pub(super) fn stacked<S: Scalar>(parts: &[&Matrix<S>]) -> Matrix<S> {
    let columns = parts.first().map_or(0, |part| part.columns());
    let rows: Vec<&[S]> = parts.iter().flat_map(|part| (0..part.rows()).map(move |i| part.row(i))).collect();
    Matrix::from_fn(rows.len(), columns, |i, j| rows[i][j].clone())
}

/// `[a b; c d]`.
pub(super) fn joined<S: Scalar>([a, b]: [&Matrix<S>; 2], [c, d]: [&Matrix<S>; 2]) -> Matrix<S> {
    stacked(&[&side_by_side(&[a, b]), &side_by_side(&[c, d])])
}

/// Some rows and columns.
pub(super) fn selected<S: Scalar>(matrix: &Matrix<S>, rows: &[usize], columns: &[usize]) -> Matrix<S> {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows[i], columns[j])].clone())
}

/// Rows and columns that follow each other.
pub(super) fn window<S: Scalar>(matrix: &Matrix<S>, rows: Range<usize>, columns: Range<usize>) -> Matrix<S> {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows.start + i, columns.start + j)].clone())
}

/// Columns that follow each other.
pub(super) fn columns_of<S: Scalar>(matrix: &Matrix<S>, columns: Range<usize>) -> Matrix<S> {
    window(matrix, 0..matrix.rows(), columns)
}

/// These columns at places among so many, and zeros elsewhere.
pub(super) fn spread<S: Scalar>(columns: &Matrix<S>, places: &[usize], count: usize) -> Matrix<S> {
    let mut out = Matrix::zeros(columns.rows(), count);
    for (j, &place) in places.iter().enumerate() {
        (0..columns.rows()).for_each(|i| out[(i, place)] = columns[(i, j)].clone());
    }
    out
}

/// Whether all entries are finite.
pub(super) fn is_finite(matrix: &Matrix<f64>) -> bool {
    matrix.as_slice().iter().all(|x| x.is_finite())
}

/// The exact values of finite numbers; zero for others.
pub(super) fn exactly(matrix: &Matrix<f64>) -> Matrix<Rational> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| rational_from_f64(matrix[(i, j)]).unwrap_or_default())
}
