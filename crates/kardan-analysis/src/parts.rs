//! Parts of exact matrices, matrices beside and above each other, and their kernels.

use std::ops::Range;

use kardan_math::num::{Echelon, Matrix, Rational, echelon};

/// The rows with these numbers.
pub(super) fn rows_of(matrix: &Matrix<Rational>, rows: &[usize]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), matrix.columns(), |i, j| matrix[(rows[i], j)].clone())
}

/// The columns with these numbers.
pub(super) fn columns_of(matrix: &Matrix<Rational>, columns: &[usize]) -> Matrix<Rational> {
    Matrix::from_fn(matrix.rows(), columns.len(), |i, j| matrix[(i, columns[j])].clone())
}

/// A block of consecutive rows and columns.
pub(super) fn block(matrix: &Matrix<Rational>, rows: Range<usize>, columns: Range<usize>) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), columns.len(), |i, j| matrix[(rows.start + i, columns.start + j)].clone())
}

/// Two matrices beside each other.
pub(super) fn beside(left: &Matrix<Rational>, right: &Matrix<Rational>) -> Matrix<Rational> {
    let width = left.columns();
    Matrix::from_fn(left.rows(), width + right.columns(), |i, j| match j.checked_sub(width) {
        None => left[(i, j)].clone(),
        Some(j) => right[(i, j)].clone(),
    })
}

/// A matrix above another one.
pub(super) fn stacked(above: &Matrix<Rational>, below: &Matrix<Rational>) -> Matrix<Rational> {
    let height = above.rows();
    Matrix::from_fn(height + below.rows(), above.columns(), |i, j| match i.checked_sub(height) {
        None => above[(i, j)].clone(),
        Some(i) => below[(i, j)].clone(),
    })
}

/// The echelon form with pivots in the order of the columns.
pub(super) fn reduced_form(matrix: &Matrix<Rational>) -> Echelon {
    echelon(matrix, &(0..matrix.columns()).collect::<Vec<_>>())
}

/// A basis of the kernel, one column for each column without a pivot.
pub(super) fn kernel(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    reduced_form(matrix).kernel()
}

/// A basis of the columns.
pub(super) fn column_basis(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let found = reduced_form(&matrix.transpose());
    block(&found.form, 0..found.rank(), 0..matrix.rows()).transpose()
}

/// The entries as text, row by row.
pub(super) fn texts(matrix: &Matrix<Rational>) -> Vec<Vec<String>> {
    (0..matrix.rows()).map(|i| matrix.row(i).iter().map(ToString::to_string).collect()).collect()
}
