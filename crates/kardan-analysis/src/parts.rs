//! Parts of exact matrices, matrices made of parts, and their kernels.

use dashu_int::ops::BitTest;
use kardan_math::num::{Matrix, Rational, echelon};
pub(super) use kardan_math::num::{columns_of, joined, kernel, reduced_form, rows_of, side_by_side, stacked, window};

/// `s E − A`.
pub(super) fn pencil_at(e: &Matrix<Rational>, a: &Matrix<Rational>, s: &Rational) -> Matrix<Rational> {
    e.scale(s).minus(a)
}

/// The spaces of all x that begin the (x, v) with `matrix · (x, v)` in the span of `image · space`, each from the one before it, until they
/// keep their dimension.
pub(super) fn limit_space(
    matrix: &Matrix<Rational>,
    image: &Matrix<Rational>,
    mut space: Matrix<Rational>,
) -> Matrix<Rational> {
    let n = image.columns();
    loop {
        let combined = kernel(&side_by_side(&[matrix, &image.multiply(&space)]));
        let next = column_basis(&window(&combined, 0..n, 0..combined.columns()));
        if next.columns() == space.columns() {
            return next;
        }
        space = next;
    }
}

/// A basis of the rows y with `y M = 0`. Late rows of M are left alone by as many of them as possible.
pub(super) fn left_kernel(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let order: Vec<usize> = (0..matrix.rows()).rev().collect();
    echelon(&matrix.transpose(), &order).kernel().transpose()
}

/// A basis of the columns.
pub(super) fn column_basis(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let found = reduced_form(&matrix.transpose());
    window(&found.form, 0..found.rank(), 0..matrix.rows()).transpose()
}

/// Bits of numerator and denominator.
pub(super) fn bits_of(x: &Rational) -> usize {
    x.numerator().bit_len() + x.denominator().bit_len()
}

/// The entries as text, row by row.
pub(super) fn texts(matrix: &Matrix<Rational>) -> Vec<Vec<String>> {
    (0..matrix.rows()).map(|i| matrix.row(i).iter().map(ToString::to_string).collect()).collect()
}
