//! Sparse rows and their reduced echelon form.

use std::collections::BTreeMap;

use super::{Matrix, Rational, Scalar};

/// A sparse row: `(column, entry)`, sorted, no zeros.
pub type SparseRow = Vec<(usize, Rational)>;

/// The reduced row echelon form of a sparse matrix.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SparseEchelon {
    /// Each pivot column with the other entries of its row: `x_pivot + Σ entry · x_column = 0` on the kernel. No entry is
    /// in a pivot column.
    pub rows: BTreeMap<usize, SparseRow>,
}

impl SparseEchelon {
    /// The rank, exact.
    pub fn rank(&self) -> usize {
        self.rows.len()
    }

    /// The basis of the kernel that is the identity on the columns `free` (all that are no pivots): one sparse row for
    /// each of `columns` columns of the matrix, its entries numbered as in `free`.
    ///
    /// # Panics
    /// If a column that is no pivot is missing in `free`.
    pub fn kernel(&self, columns: usize, free: &[usize]) -> Vec<SparseRow> {
        let number: BTreeMap<usize, usize> = free.iter().enumerate().map(|(k, column)| (*column, k)).collect();
        let row = |column| match self.rows.get(&column) {
            None => vec![(number[&column], Rational::ONE)],
            Some(row) => {
                let mut row: SparseRow = row.iter().map(|(j, x)| (number[j], Rational::ZERO.minus(x))).collect();
                row.sort_by_key(|(j, _)| *j);
                row
            }
        };
        (0..columns).map(row).collect()
    }
}

/// Brings sparse rows to reduced row echelon form over the rationals, taking pivots in the given order of columns.
///
/// Same result as [`echelon`](super::echelon), for large matrices with few entries: rows are never made dense, and those
/// below a pivot are reduced before those above it, so that a chain of neighbours costs a number of operations that is
/// proportional to its length.
///
/// # Panics
/// If a row has an entry in a column that `order` does not name.
pub fn sparse_echelon<'a>(rows: impl IntoIterator<Item = &'a SparseRow>, order: &[usize]) -> SparseEchelon {
    let place: BTreeMap<usize, usize> = order.iter().enumerate().map(|(place, column)| (*column, place)).collect();
    // Rows by the place of their pivot, without the pivot's entry 1.
    let mut found: BTreeMap<usize, BTreeMap<usize, Rational>> = BTreeMap::new();
    for row in rows {
        let mut open: BTreeMap<usize, Rational> = row.iter().map(|(column, x)| (place[column], x.clone())).collect();
        while let Some((pivot, x)) = open.pop_first() {
            if let Some(other) = found.get(&pivot) {
                add_scaled(&mut open, &-x, other);
            } else {
                let scaled = open.into_iter().map(|(at, y)| (at, y.over(&x))).collect();
                found.insert(pivot, scaled);
                break;
            }
        }
    }
    let pivots: Vec<usize> = found.keys().rev().copied().collect();
    for pivot in pivots {
        let mut row = found.remove(&pivot).unwrap_or_default();
        let reducible: Vec<usize> = row.keys().filter(|at| found.contains_key(at)).copied().collect();
        for at in reducible {
            if let Some(x) = row.remove(&at) {
                add_scaled(&mut row, &-x, &found[&at]);
            }
        }
        found.insert(pivot, row);
    }
    let unplaced = |(pivot, row): (usize, BTreeMap<usize, Rational>)| {
        let mut row: SparseRow = row.into_iter().map(|(at, x)| (order[at], x)).collect();
        row.sort_by_key(|(column, _)| *column);
        (order[pivot], row)
    };
    SparseEchelon { rows: found.into_iter().map(unplaced).collect() }
}

/// Adds `factor · other` to a row without zeros.
pub(super) fn add_scaled<'a>(
    row: &mut BTreeMap<usize, Rational>,
    factor: &Rational,
    other: impl IntoIterator<Item = (&'a usize, &'a Rational)>,
) {
    for (at, y) in other {
        let entry = row.entry(*at).or_insert(Rational::ZERO);
        *entry = entry.plus(&factor.times(y));
        if entry.is_zero() {
            row.remove(at);
        }
    }
}

/// `rowᵀ · basis` for a basis given by one sparse row for each column of `row`.
pub fn project(row: &SparseRow, basis: &[SparseRow]) -> SparseRow {
    let mut out = BTreeMap::<usize, Rational>::new();
    for (at, x) in row {
        add_scaled(&mut out, x, basis[*at].iter().map(|(j, y)| (j, y)));
    }
    out.into_iter().collect()
}

/// The rows of a matrix without their zeros.
pub fn sparse_rows(matrix: &Matrix<Rational>) -> Vec<SparseRow> {
    let row = |i: usize| matrix.row(i).iter().enumerate().filter(|(_, x)| !x.is_zero()).map(|(j, x)| (j, x.clone()));
    (0..matrix.rows()).map(|i| row(i).collect()).collect()
}

/// The matrix of these rows.
///
/// # Panics
/// If a row has an entry behind the last column.
pub fn dense_rows<R: AsRef<[(usize, Rational)]>>(rows: &[R], columns: usize) -> Matrix<Rational> {
    let mut out = Matrix::<Rational>::zeros(rows.len(), columns);
    for (i, row) in rows.iter().enumerate() {
        row.as_ref().iter().for_each(|(j, x)| out[(i, *j)] = x.clone());
    }
    out
}

/// `Σ c a aᵀ` of terms `(a, c)` over n coordinates, row by row.
pub fn sparse_sum_of_outer<R: AsRef<[(usize, Rational)]>>(
    terms: impl IntoIterator<Item = (R, Rational)>,
    n: usize,
) -> Vec<SparseRow> {
    let mut out = vec![BTreeMap::<usize, Rational>::new(); n];
    for (row, factor) in terms {
        for (i, x) in row.as_ref() {
            add_scaled(&mut out[*i], &factor.times(x), row.as_ref().iter().map(|(j, y)| (j, y)));
        }
    }
    out.into_iter().map(|row| row.into_iter().collect()).collect()
}

/// `Σ c a aᵀ` of terms `(a, c)` over n coordinates.
pub fn sum_of_outer<R: AsRef<[(usize, Rational)]>>(
    terms: impl IntoIterator<Item = (R, Rational)>,
    n: usize,
) -> Matrix<Rational> {
    dense_rows(&sparse_sum_of_outer(terms, n), n)
}

#[cfg(test)]
#[path = "../../tests/unit/num/sparse.rs"]
mod tests;
