//! Gaussian elimination: the reduced row echelon form of a matrix.

use std::collections::BTreeMap;

use super::sparse::add_scaled;
use super::{Matrix, Rational, Scalar, SparseRow, sparse_rows};

/// The reduced row echelon form of a matrix, with the way it was reached.
#[derive(Debug, Clone)]
pub struct Echelon {
    /// Rows in echelon form; zero rows last. `form = transform · original`.
    pub form: Matrix<Rational>,
    /// Which original rows make each row.
    pub transform: Matrix<Rational>,
    /// Pivot column of each nonzero row.
    pub pivots: Vec<usize>,
}

impl Echelon {
    /// The rank, exact.
    pub fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// The columns that are no pivots, ascending.
    pub fn free(&self) -> Vec<usize> {
        (0..self.form.columns()).filter(|column| !self.pivots.contains(column)).collect()
    }

    /// A basis of the kernel, one column for each free column, on which it is the identity.
    ///
    /// ```
    /// use kardan_math::num::{Matrix, Rational, echelon};
    /// let row = Matrix::from_fn(1, 3, |_, j| Rational::from([1, 2, 0][j]));
    /// let kernel = echelon(&row, &[0, 1, 2]).kernel();
    /// assert_eq!(kernel.to_f64().to_rows(), [[-2.0, 0.0], [1.0, 0.0], [0.0, 1.0]]);
    /// ```
    pub fn kernel(&self) -> Matrix<Rational> {
        let free = self.free();
        let mut out = Matrix::zeros(self.form.columns(), free.len());
        for (k, &column) in free.iter().enumerate() {
            out[(column, k)] = Rational::ONE;
            for (row, &pivot) in self.pivots.iter().enumerate() {
                out[(pivot, k)] = Rational::ZERO.minus(&self.form[(row, column)]);
            }
        }
        out
    }

    /// For every dependency among the original rows, the rows that take part in it.
    ///
    /// Method: the rows of `transform` that belong to zero rows span the left null space exactly.
    pub fn dependent_rows(&self) -> Vec<Vec<usize>> {
        (self.rank()..self.form.rows())
            .map(|i| (0..self.transform.columns()).filter(|&j| !self.transform[(i, j)].is_zero()).collect())
            .collect()
    }
}

/// Brings a matrix to reduced row echelon form over the rationals, taking pivots in the given order of columns.
///
/// A column early in `order` becomes a pivot if it can; columns that must stay free come last.
/// Exact; cost O(rows² · columns) rational operations.
///
/// ```
/// use kardan_math::num::{Matrix, Rational, echelon};
/// // The third row is the sum of the first two.
/// let rows = [[1, -51, 50], [0, 1, -1], [1, -50, 49]];
/// let e = echelon(&Matrix::from_fn(3, 3, |i, j| Rational::from(rows[i][j])), &[0, 1, 2]);
/// assert_eq!(e.rank(), 2);
/// assert_eq!(e.dependent_rows(), [vec![0, 1, 2]]);
/// ```
///
/// # Panics
/// If `order` names a column that does not exist.
pub fn echelon(matrix: &Matrix<Rational>, order: &[usize]) -> Echelon {
    let rows = matrix.rows();
    let mut form = matrix.clone();
    let mut transform = Matrix::identity(rows);
    let mut pivots = Vec::new();
    for &column in order {
        let rank = pivots.len();
        let Some(pivot) = (rank..rows).find(|&i| !form[(i, column)].is_zero()) else { continue };
        form.swap_rows(rank, pivot);
        transform.swap_rows(rank, pivot);
        let inverse = Rational::one().over(&form[(rank, column)]);
        scale_row(&mut form, rank, &inverse);
        scale_row(&mut transform, rank, &inverse);
        for i in 0..rows {
            if i != rank && !form[(i, column)].is_zero() {
                let factor = form[(i, column)].clone();
                subtract_row(&mut form, i, rank, &factor);
                subtract_row(&mut transform, i, rank, &factor);
            }
        }
        pivots.push(column);
    }
    Echelon { form, transform, pivots }
}

/// The reduced row echelon form with pivots in the order of the columns.
pub fn reduced_form(matrix: &Matrix<Rational>) -> Echelon {
    echelon(matrix, &(0..matrix.columns()).collect::<Vec<_>>())
}

/// A basis of the kernel, one column for each column without a pivot.
pub fn kernel(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    reduced_form(matrix).kernel()
}

fn scale_row(matrix: &mut Matrix<Rational>, row: usize, factor: &Rational) {
    for entry in matrix.row_mut(row) {
        *entry = entry.times(factor);
    }
}

fn subtract_row(matrix: &mut Matrix<Rational>, from: usize, row: usize, factor: &Rational) {
    for j in 0..matrix.columns() {
        if !matrix[(row, j)].is_zero() {
            matrix[(from, j)] = matrix[(from, j)].minus(&factor.times(&matrix[(row, j)]));
        }
    }
}

/// The sign of a symmetric matrix as a quadratic form.
#[derive(Debug, Clone, PartialEq)]
pub enum Definiteness {
    /// xᵀMx > 0 for all x ≠ 0.
    Positive,
    /// xᵀMx ≥ 0, zero along `direction`.
    PositiveSemi {
        /// A vector with `M·direction = 0`.
        direction: Vec<Rational>,
    },
    /// xᵀMx < 0 for the vector given.
    Indefinite {
        /// The witness x.
        witness: Vec<Rational>,
    },
}

/// Decides whether a symmetric rational matrix is positive definite, semidefinite or neither, exactly, with a witness.
///
/// Method: elimination by congruence, `EᵀME` diagonal; cost O(n³) rational operations, for a band as many as it has entries. Of E
/// the column that is a witness is computed alone.
///
/// ```
/// use kardan_math::num::{Definiteness, Matrix, Rational, definiteness};
/// let spring = [[1, -1], [-1, 1]];
/// let verdict = definiteness(&Matrix::from_fn(2, 2, |i, j| Rational::from(spring[i][j])));
/// // Both bodies turning together do not stretch the spring.
/// assert_eq!(verdict, Definiteness::PositiveSemi { direction: vec![Rational::ONE, Rational::ONE] });
/// ```
///
/// # Panics
/// If the matrix is not square.
pub fn definiteness(matrix: &Matrix<Rational>) -> Definiteness {
    assert_eq!(matrix.rows(), matrix.columns(), "definiteness of a matrix that is not square");
    definiteness_of_rows(&sparse_rows(matrix))
}

/// The same of a symmetric matrix given by its rows.
pub fn definiteness_of_rows(matrix: &[SparseRow]) -> Definiteness {
    let n = matrix.len();
    // The rest of the upper triangle: in each row the entries from the diagonal on, without zeros.
    let upper = |(i, row): (usize, &SparseRow)| row.iter().filter(|(j, _)| *j >= i).cloned().collect();
    let mut rows: Vec<BTreeMap<usize, Rational>> = matrix.iter().enumerate().map(upper).collect();
    let mut factors: Vec<SparseRow> = Vec::with_capacity(n);
    let mut null = None;
    for k in 0..n {
        let mut row = std::mem::take(&mut rows[k]);
        let Some(pivot) = row.remove(&k) else {
            if let Some((&j, entry)) = row.first_key_value() {
                // (t·e_k + e_j) gives 2·t·m_kj + m_jj < 0 for t = −(m_jj + 1)/(2·m_kj).
                let two = Rational::ONE.plus(&Rational::ONE);
                let size = rows[j].get(&j).map_or(Rational::ONE, |m| m.plus(&Rational::ONE));
                let t = Rational::ZERO.minus(&size).over(&two.times(entry));
                let (this, other) = (diagonal_direction(&factors, k, n), diagonal_direction(&factors, j, n));
                let witness = this.iter().zip(&other).map(|(x, y)| t.times(x).plus(y)).collect();
                return Definiteness::Indefinite { witness };
            }
            null.get_or_insert(k);
            factors.push(Vec::new());
            continue;
        };
        if pivot < Rational::ZERO {
            return Definiteness::Indefinite { witness: diagonal_direction(&factors, k, n) };
        }
        let factor: SparseRow = row.iter().map(|(&j, x)| (j, x.over(&pivot))).collect();
        for (j, x) in &factor {
            add_scaled(&mut rows[*j], &-x, row.range(j..));
        }
        factors.push(factor);
    }
    match null {
        None => Definiteness::Positive,
        Some(k) => Definiteness::PositiveSemi { direction: diagonal_direction(&factors[..k], k, n) },
    }
}

/// Column `k` of the E that the first steps have made, with `m_kj / m_kk` of each step in `factors`: x with `x_k = 1` and
/// `x_l + Σ factor_lj x_j = 0` for each step l.
fn diagonal_direction(factors: &[SparseRow], k: usize, n: usize) -> Vec<Rational> {
    let mut x = vec![Rational::ZERO; n];
    x[k] = Rational::ONE;
    for (l, row) in factors.iter().enumerate().rev() {
        x[l] = row.iter().fold(Rational::ZERO, |sum, (j, factor)| sum.minus(&factor.times(&x[*j])));
    }
    x
}

#[cfg(test)]
#[path = "../../tests/unit/num/elimination.rs"]
mod tests;
