//! The exact characteristic polynomial of a matrix.

use dashu_int::ops::{BitTest, UnsignedAbs};
use dashu_int::{IBig, UBig};

use super::{
    Matrix, ModularMatrix, Polynomial, PrimeField, Rational, Reconstruction, Scalar, common_denominator, prime_below,
    routh_column, whole_multiple,
};

/// det(sI − M), exact.
///
/// Method: with the common denominator d, dM is whole and so is its characteristic polynomial. Its coefficients are at most
/// `(1 + r)ⁿ` with the largest sum r of sizes in a row of dM (Hadamard); modulo primes whose product exceeds double that they
/// are known. Cost: O(n³) for each of about `n log₂(r)/60` primes.
///
/// ```
/// use kardan_math::num::{Matrix, Rational, characteristic_polynomial};
/// let a = Matrix::from_fn(2, 2, |i, j| Rational::from([[1, 2], [3, 4]][i][j]));
/// assert_eq!(characteristic_polynomial(&a).coefficients(), [-2, -5, 1].map(Rational::from));
/// ```
pub fn characteristic_polynomial(matrix: &Matrix<Rational>) -> Polynomial {
    let n = matrix.rows();
    let d = common_denominator(matrix.as_slice());
    let whole: Vec<IBig> = matrix.as_slice().iter().map(|x| whole_multiple(x, &d)).collect();
    let sizes = whole.chunks(n.max(1)).map(|row| row.iter().fold(UBig::ONE, |sum, x| sum + x.unsigned_abs()));
    let mut bits = n * sizes.map(|r| r.bit_len()).max().unwrap_or(0) + 2;
    let mut all = Reconstruction::new();
    let mut prime = 1 << 61;
    loop {
        prime = prime_below(prime);
        let field = PrimeField::new(prime);
        let image = ModularMatrix::from_fn(n, n, |i, j| field.whole(&whole[i * n + j]));
        let coefficients = image.characteristic_polynomial(&field);
        all.add(prime, &coefficients.iter().map(|&c| field.value(c)).collect::<Vec<_>>());
        if bits < 60 {
            break;
        }
        bits -= 60;
    }
    let mut power = Rational::ONE;
    let mut out: Vec<Rational> = Vec::with_capacity(n + 1);
    for c in all.integers().into_iter().rev() {
        out.push(Rational::from(c).over(&power));
        power = power.times(&Rational::from(d.clone()));
    }
    out.reverse();
    Polynomial::new(out)
}

/// Whether all roots are in the open left half plane, decided exactly (Routh). Constants other than zero are.
pub fn is_hurwitz(polynomial: &Polynomial) -> bool {
    let column = routh_column(polynomial);
    column.len() == polynomial.degree() + 1 && column.iter().all(|x| *x > Rational::ZERO)
}

#[cfg(test)]
#[path = "../../tests/unit/num/characteristic.rs"]
mod tests;
