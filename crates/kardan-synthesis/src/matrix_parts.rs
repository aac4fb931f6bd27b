//! Parts of matrices, matrices that are made of parts, and what their entries are.

use std::ops::Range;

use kardan_math::num::{Matrix, Rational, Scalar, rational_from_f64};
pub(super) use kardan_math::num::{joined, selected, side_by_side, stacked, window};

/// Columns that follow each other.
pub(super) fn column_range<S: Scalar>(matrix: &Matrix<S>, columns: Range<usize>) -> Matrix<S> {
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
