//! Dense matrices.

use super::Scalar;

/// A dense matrix stored row by row.
///
/// One type for both number kinds: `Matrix<f64>` and `Matrix<Rational>`.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrix<S> {
    rows: usize,
    columns: usize,
    data: Vec<S>,
}

impl<S: Scalar> Matrix<S> {
    /// `rows × columns` zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, data: vec![S::zero(); rows * columns] }
    }

    /// The `n × n` identity.
    pub fn identity(n: usize) -> Self {
        let mut out = Self::zeros(n, n);
        for i in 0..n {
            out[(i, i)] = S::one();
        }
        out
    }

    /// Entry by entry: `f(row, column)`.
    pub fn from_fn(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> S) -> Self {
        let mut data = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            for j in 0..columns {
                data.push(f(i, j));
            }
        }
        Self { rows, columns, data }
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
    pub fn row(&self, i: usize) -> &[S] {
        &self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// One row, to write.
    pub fn row_mut(&mut self, i: usize) -> &mut [S] {
        &mut self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// All entries, row by row.
    pub fn as_slice(&self) -> &[S] {
        &self.data
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self[(j, i)].clone())
    }

    /// `self · other`.
    ///
    /// # Panics
    /// If the inner dimensions differ.
    pub fn multiply(&self, other: &Self) -> Self {
        assert_eq!(
            self.columns, other.rows,
            "matrix product of {}x{} and {}x{}",
            self.rows, self.columns, other.rows, other.columns
        );
        // Zeros are passed over: matrices of drivetrains have few other entries.
        let filled = |row: &[S]| (0..row.len()).filter(|&j| !row[j].is_zero()).collect::<Vec<usize>>();
        let filled: Vec<Vec<usize>> = (0..other.rows).map(|k| filled(other.row(k))).collect();
        let mut out = Self::zeros(self.rows, other.columns);
        for i in 0..self.rows {
            for (k, factor) in self.row(i).iter().enumerate().filter(|(_, factor)| !factor.is_zero()) {
                for &j in &filled[k] {
                    out[(i, j)] = out[(i, j)].plus(&factor.times(&other[(k, j)]));
                }
            }
        }
        out
    }

    /// `self + other`.
    ///
    /// # Panics
    /// If the shapes differ.
    pub fn plus(&self, other: &Self) -> Self {
        self.entry_by_entry(other, S::plus)
    }

    /// `self − other`.
    ///
    /// # Panics
    /// If the shapes differ.
    pub fn minus(&self, other: &Self) -> Self {
        self.entry_by_entry(other, S::minus)
    }

    fn entry_by_entry(&self, other: &Self, f: impl Fn(&S, &S) -> S) -> Self {
        assert_eq!((self.rows, self.columns), (other.rows, other.columns), "matrices of different shape");
        let data = self.data.iter().zip(&other.data).map(|(a, b)| f(a, b)).collect();
        Self { rows: self.rows, columns: self.columns, data }
    }

    /// `factor · self`.
    pub fn scale(&self, factor: &S) -> Self {
        Self { rows: self.rows, columns: self.columns, data: self.data.iter().map(|a| a.times(factor)).collect() }
    }

    /// Adds `factor · row rowᵀ`, the one way in which a term enters a matrix.
    ///
    /// # Panics
    /// If the matrix is not square of the row's length.
    pub fn add_outer(&mut self, factor: &S, row: &[S]) {
        assert!(self.rows == row.len() && self.columns == row.len(), "outer product of a different size");
        for i in 0..row.len() {
            if row[i].is_zero() {
                continue;
            }
            let scaled = factor.times(&row[i]);
            for j in 0..row.len() {
                if !row[j].is_zero() {
                    self[(i, j)] = self[(i, j)].plus(&scaled.times(&row[j]));
                }
            }
        }
    }

    /// Solves `self · X = right` by Gauss elimination with pivoting on the largest entry; `None` if singular.
    ///
    /// Exact over rationals. Cost O(n³).
    ///
    /// # Panics
    /// If `self` is not square or the row numbers differ.
    pub fn solve(&self, right: &Self) -> Option<Self> {
        assert!(
            self.rows == self.columns && self.rows == right.rows,
            "solve needs a square matrix and matching right-hand side"
        );
        let n = self.rows;
        let (mut a, mut b) = (self.clone(), right.clone());
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| a[(i, k)].to_f64().abs().total_cmp(&a[(j, k)].to_f64().abs()))?;
            let pivot = if a[(pivot, k)].is_zero() { (k..n).find(|&i| !a[(i, k)].is_zero())? } else { pivot };
            a.swap_rows(k, pivot);
            b.swap_rows(k, pivot);
            for i in k + 1..n {
                if a[(i, k)].is_zero() {
                    continue;
                }
                let factor = a[(i, k)].over(&a[(k, k)]);
                a.subtract_row((i, k), &factor, k);
                b.subtract_row((i, k), &factor, 0);
            }
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                if !a[(i, k)].is_zero() {
                    b.subtract_row((i, k), &a[(i, k)], 0);
                }
            }
            b.row_mut(i).iter_mut().for_each(|x| *x = x.over(&a[(i, i)]));
        }
        Some(b)
    }

    /// Row i ← row i − factor · row k, from a column on.
    fn subtract_row(&mut self, (i, k): (usize, usize), factor: &S, from: usize) {
        let (low, high) = self.data.split_at_mut(i.max(k) * self.columns);
        let (first, second) = (&mut low[i.min(k) * self.columns..][..self.columns], &mut high[..self.columns]);
        let (row, other) = if i < k { (first, &*second) } else { (second, &*first) };
        for (x, y) in row[from..].iter_mut().zip(&other[from..]) {
            *x = x.minus(&factor.times(y));
        }
    }

    /// Exchanges two rows.
    pub fn swap_rows(&mut self, i: usize, j: usize) {
        if i != j {
            for k in 0..self.columns {
                self.data.swap(i * self.columns + k, j * self.columns + k);
            }
        }
    }

    /// Every entry as the nearest `f64`.
    pub fn to_f64(&self) -> Matrix<f64> {
        Matrix { rows: self.rows, columns: self.columns, data: self.data.iter().map(Scalar::to_f64).collect() }
    }

    /// Rows as nested vectors, for display.
    pub fn to_rows(&self) -> Vec<Vec<f64>> {
        (0..self.rows).map(|i| self.row(i).iter().map(Scalar::to_f64).collect()).collect()
    }
}

impl<S> std::ops::Index<(usize, usize)> for Matrix<S> {
    type Output = S;
    fn index(&self, (i, j): (usize, usize)) -> &S {
        &self.data[i * self.columns + j]
    }
}

impl<S> std::ops::IndexMut<(usize, usize)> for Matrix<S> {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut S {
        &mut self.data[i * self.columns + j]
    }
}
