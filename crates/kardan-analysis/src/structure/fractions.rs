//! Matrices of fractions: products, images modulo a prime.

use kardan_math::num::{Matrix, ModularMatrix, PrimeField, Rational, Scalar};

/// A product that skips the zeros of the right factor.
pub(super) fn multiply_sparse(left: &Matrix<Rational>, right: &Matrix<Rational>) -> Matrix<Rational> {
    let mut out = Matrix::<Rational>::zeros(left.rows(), right.columns());
    for k in 0..right.rows() {
        for j in (0..right.columns()).filter(|&j| !right[(k, j)].is_zero()) {
            for i in (0..left.rows()).filter(|&i| !left[(i, k)].is_zero()) {
                out[(i, j)] = out[(i, j)].plus(&left[(i, k)].times(&right[(k, j)]));
            }
        }
    }
    out
}

/// The values of all entries, row by row.
pub(super) fn values(field: &PrimeField, matrix: &ModularMatrix) -> Vec<u64> {
    (0..matrix.rows).flat_map(|i| matrix.row(i).iter().map(|&x| field.value(x))).collect()
}
