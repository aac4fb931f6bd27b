//! Matrices of polynomials.

use kardan_math::num::{Matrix, Polynomial, Rational};

/// A matrix of polynomials in s, stored row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct PolynomialMatrix {
    rows: usize,
    columns: usize,
    entries: Vec<Polynomial>,
}

impl PolynomialMatrix {
    /// Entry by entry: `f(row, column)`.
    pub fn from_fn(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> Polynomial) -> Self {
        let entries = (0..rows * columns).map(|k| f(k / columns, k % columns)).collect();
        Self { rows, columns, entries }
    }

    /// A matrix without s.
    pub fn constant(matrix: &Matrix<Rational>) -> Self {
        Self::from_fn(matrix.rows(), matrix.columns(), |i, j| Polynomial::constant(matrix[(i, j)].clone()))
    }

    /// From rows of the same length; `columns` counts if there are none.
    pub(super) fn from_rows(rows: Vec<Vec<Polynomial>>, columns: usize) -> Self {
        Self { rows: rows.len(), columns, entries: rows.into_iter().flatten().collect() }
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// One row.
    pub fn row(&self, i: usize) -> &[Polynomial] {
        &self.entries[i * self.columns..(i + 1) * self.columns]
    }

    /// The highest degree in a column; 0 for constants and zeros.
    pub fn column_degree(&self, j: usize) -> usize {
        (0..self.rows).map(|i| self[(i, j)].degree()).max().unwrap_or(0)
    }

    /// The matrix of the coefficients of sᵏ.
    pub fn coefficient(&self, k: usize) -> Matrix<Rational> {
        Matrix::from_fn(self.rows, self.columns, |i, j| self[(i, j)].coefficient(k))
    }

    /// The value at a number.
    pub fn evaluate(&self, s: &Rational) -> Matrix<Rational> {
        Matrix::from_fn(self.rows, self.columns, |i, j| self[(i, j)].evaluate(s))
    }

    /// `self + other`.
    ///
    /// # Panics
    /// If the shapes differ.
    pub fn plus(&self, other: &Self) -> Self {
        assert_eq!((self.rows, self.columns), (other.rows, other.columns), "sum of matrices of different shape");
        Self::from_fn(self.rows, self.columns, |i, j| self[(i, j)].plus(&other[(i, j)]))
    }

    /// `self · other`.
    ///
    /// # Panics
    /// If the inner dimensions differ.
    pub fn multiply(&self, other: &Self) -> Self {
        assert_eq!(self.columns, other.rows, "product of matrices that do not fit");
        Self::from_fn(self.rows, other.columns, |i, j| {
            (0..self.columns).fold(Polynomial::default(), |sum, k| sum.plus(&self[(i, k)].times(&other[(k, j)])))
        })
    }

    /// Every entry times a polynomial.
    pub fn scale(&self, factor: &Polynomial) -> Self {
        Self::from_fn(self.rows, self.columns, |i, j| factor.times(&self[(i, j)]))
    }
}

impl std::ops::Index<(usize, usize)> for PolynomialMatrix {
    type Output = Polynomial;
    fn index(&self, (i, j): (usize, usize)) -> &Polynomial {
        &self.entries[i * self.columns + j]
    }
}

/// `s · p`.
pub(super) fn derivative(p: &Polynomial) -> Polynomial {
    Polynomial::new(std::iter::once(Rational::ZERO).chain(p.coefficients().iter().cloned()).collect())
}
