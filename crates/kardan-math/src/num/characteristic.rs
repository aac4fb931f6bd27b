//! The exact characteristic polynomial of a matrix.

use super::{Matrix, Polynomial, Rational, resolvent, routh_column};

/// The characteristic polynomial `det(sI − M)`, exact and proven.
///
/// Cost: n³ operations modulo each of so many primes that their product exceeds a bound of Hadamard's kind (n = 40 with
/// decimals as parameters: some dozens).
///
/// ```
/// use kardan_math::num::{Matrix, Rational, characteristic_polynomial};
/// let a = Matrix::from_fn(2, 2, |i, j| Rational::from([[1, 2], [3, 4]][i][j]));
/// assert_eq!(characteristic_polynomial(&a).coefficients(), [-2, -5, 1].map(Rational::from));
/// ```
///
/// # Panics
/// If M is not square.
pub fn characteristic_polynomial(matrix: &Matrix<Rational>) -> Polynomial {
    let n = matrix.rows();
    resolvent(matrix, &Matrix::zeros(n, 0), &Matrix::zeros(0, n), &Matrix::zeros(0, 0)).characteristic
}

/// Whether all roots are in the open left half plane, decided exactly (Routh). Constants other than zero are.
pub fn is_hurwitz(polynomial: &Polynomial) -> bool {
    let column = routh_column(polynomial);
    column.len() == polynomial.degree() + 1 && column.iter().all(|x| *x > Rational::ZERO)
}

#[cfg(test)]
#[path = "../../tests/unit/num/characteristic.rs"]
mod tests;
