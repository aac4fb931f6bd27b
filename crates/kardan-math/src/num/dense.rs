//! Products of dense matrices in floating point, eight sums in parallel.

use kardan_rt::functions::ln;

use super::Matrix;

/// Sums that are computed in parallel.
pub const LANES: usize = 8;

/// A matrix for products with vectors: eight rows at a time, column by column, so that eight sums run in parallel.
#[derive(Debug, Clone)]
pub struct Panels {
    columns: usize,
    data: Vec<[f64; LANES]>,
}

impl Panels {
    /// Of a matrix with at least one column.
    pub fn new(matrix: &Matrix<f64>) -> Self {
        let (rows, columns) = (matrix.rows(), matrix.columns());
        let entry = |i: usize, j: usize| if i < rows { matrix[(i, j)] } else { 0.0 };
        let column = |first: usize, j: usize| std::array::from_fn(|lane| entry(first + lane, j));
        let panels = (0..rows).step_by(LANES);
        let data = panels.flat_map(|first| (0..columns).map(move |j| column(first, j))).collect();
        Self { columns, data }
    }

    /// The product with a vector, eight entries at a time; zeros after the last one.
    pub fn products(&self, x: &[f64]) -> impl Iterator<Item = [f64; LANES]> {
        self.data.chunks_exact(self.columns).map(|panel| lanes(x, panel.iter()))
    }

    /// `out = self · x`.
    pub fn apply(&self, x: &[f64], out: &mut [f64]) {
        for (out, sums) in out.chunks_mut(LANES).zip(self.products(x)) {
            out.copy_from_slice(&sums[..out.len()]);
        }
    }
}

/// Sum of the columns, each times a number.
fn lanes<'a>(x: &[f64], columns: impl Iterator<Item = &'a [f64; LANES]>) -> [f64; LANES] {
    let mut sums = [0.0; LANES];
    for (x, column) in x.iter().zip(columns) {
        for (sum, entry) in sums.iter_mut().zip(column) {
            *sum += x * entry;
        }
    }
    sums
}

/// `out = a · b` for matrices that have few zeros; for others, [`Matrix::multiply`].
///
/// # Panics
/// If the shapes do not fit.
pub fn product(a: &Matrix<f64>, b: &Matrix<f64>, out: &mut Matrix<f64>) {
    product_of_leading([a, b], [a.rows(), b.rows()], out);
}

/// The first rows of `out = a · b`, as many as are given, of b whose rows after this many are zero.
pub(super) fn product_of_leading([a, b]: [&Matrix<f64>; 2], [rows, inner]: [usize; 2], out: &mut Matrix<f64>) {
    let columns = b.columns();
    assert!(
        (a.rows(), a.columns(), columns) == (out.rows(), b.rows(), out.columns()),
        "product of matrices that do not fit"
    );
    let whole = columns - columns % LANES;
    for i in 0..rows {
        let (factors, out) = (&a.row(i)[..inner], out.row_mut(i));
        for first in (0..whole).step_by(LANES) {
            let rows = b.as_slice()[first..].chunks(columns).filter_map(|row| row.first_chunk());
            out[first..first + LANES].copy_from_slice(&lanes(factors, rows));
        }
        for j in whole..columns {
            out[j] = factors.iter().enumerate().fold(0.0, |sum, (k, factor)| sum + factor * b[(k, j)]);
        }
    }
}

/// A Cholesky factorisation `M = LLᵀ` with memory of its own, for repeated use without allocation.
///
/// Zeros at the beginning of the rows of M stay zeros of L and cost no time: a matrix of a chain, numbered in its order, is factored and solved
/// in time proportional to its length.
#[derive(Debug, Clone)]
pub struct Cholesky {
    n: usize,
    lower: Vec<f64>,
    /// First column of each row that is not zero.
    first: Vec<usize>,
    /// Whether that is the same for all matrices.
    profiled: bool,
}

impl Cholesky {
    /// Memory for `n × n` matrices.
    pub fn new(n: usize) -> Self {
        Self { n, lower: vec![0.0; n * n], first: vec![0; n], profiled: false }
    }

    /// The same for matrices whose rows begin with zeros that are known: the first column of each row that may not be zero, at most the
    /// diagonal.
    pub fn profiled(first: Vec<usize>) -> Self {
        Self { profiled: true, lower: vec![0.0; first.len() * first.len()], n: first.len(), first }
    }

    /// Factors a symmetric matrix given row by row; returns whether it is numerically positive definite.
    ///
    /// Only the lower triangle is read. A pivot must exceed 1e-13 of its diagonal entry. Cost n³/3 flops, less where rows begin with zeros.
    pub fn factor(&mut self, matrix: &[f64]) -> bool {
        let n = self.n;
        for i in 0..n {
            let source_row = &matrix[i * n..=i * n + i];
            let (above, row) = self.lower.split_at_mut(i * n);
            if !self.profiled {
                self.first[i] = source_row.iter().position(|x| *x != 0.0).unwrap_or(i);
                row[..self.first[i]].fill(0.0);
            }
            let first = self.first[i];
            for j in first..i {
                let from = first.max(self.first[j]);
                let mut sum = source_row[j];
                for (x, y) in row[from..j].iter().zip(&above[j * n + from..j * n + j]) {
                    sum -= x * y;
                }
                row[j] = sum / above[j * n + j];
            }
            let mut pivot = source_row[i];
            for x in &row[first..i] {
                pivot -= x * x;
            }
            if !(pivot > 1e-13 * source_row[i].abs()) {
                return false;
            }
            row[i] = pivot.sqrt();
        }
        true
    }

    /// ln det M.
    pub fn log_det(&self) -> f64 {
        (0..self.n).map(|j| 2.0 * ln(self.lower[j * self.n + j])).sum()
    }

    /// Overwrites `b` with `M⁻¹ b`.
    pub fn solve(&self, b: &mut [f64]) {
        self.half_solve(b);
        self.other_half_solve(b);
    }

    /// Overwrites `b` with `L⁻¹ b`, so that `bᵀ M⁻¹ b` becomes a sum of squares.
    pub fn half_solve(&self, b: &mut [f64]) {
        for (i, &first) in self.first.iter().enumerate() {
            let row = &self.lower[i * self.n..];
            let mut sum = b[i];
            for (x, y) in row[first..i].iter().zip(&b[first..i]) {
                sum -= x * y;
            }
            b[i] = sum / row[i];
        }
    }

    /// Overwrites `b` with `L⁻ᵀ b`.
    pub fn other_half_solve(&self, b: &mut [f64]) {
        for (i, &first) in self.first.iter().enumerate().rev() {
            let row = &self.lower[i * self.n..];
            let x = b[i] / row[i];
            b[i] = x;
            for (sum, entry) in b[first..i].iter_mut().zip(&row[first..i]) {
                *sum -= entry * x;
            }
        }
    }
}

/// An LU factorisation with partial pivoting and memory of its own.
#[derive(Debug, Clone, Default)]
pub struct Lu {
    n: usize,
    data: Vec<f64>,
    order: Vec<usize>,
    work: Vec<f64>,
}

impl Lu {
    /// Memory for `n × n` matrices.
    pub fn new(n: usize) -> Self {
        Self { n, data: vec![0.0; n * n], order: vec![0; n], work: vec![0.0; n] }
    }

    /// Factors a matrix given row by row; returns false if a pivot vanishes.
    pub fn factor(&mut self, matrix: &[f64]) -> bool {
        let n = self.n;
        self.data.copy_from_slice(matrix);
        for (i, entry) in self.order.iter_mut().enumerate() {
            *entry = i;
        }
        for k in 0..n {
            let mut pivot = k;
            for i in k + 1..n {
                if self.data[i * n + k].abs() > self.data[pivot * n + k].abs() {
                    pivot = i;
                }
            }
            if self.data[pivot * n + k] == 0.0 {
                return false;
            }
            if pivot != k {
                self.order.swap(pivot, k);
                for j in 0..n {
                    self.data.swap(pivot * n + j, k * n + j);
                }
            }
            for i in k + 1..n {
                let factor = self.data[i * n + k] / self.data[k * n + k];
                self.data[i * n + k] = factor;
                for j in k + 1..n {
                    self.data[i * n + j] -= factor * self.data[k * n + j];
                }
            }
        }
        true
    }

    /// Overwrites `b` with `M⁻¹ b`.
    pub fn solve(&mut self, b: &mut [f64]) {
        let n = self.n;
        for i in 0..n {
            self.work[i] = b[self.order[i]];
        }
        for i in 0..n {
            for k in 0..i {
                self.work[i] -= self.data[i * n + k] * self.work[k];
            }
        }
        for i in (0..n).rev() {
            for k in i + 1..n {
                self.work[i] -= self.data[i * n + k] * self.work[k];
            }
            self.work[i] /= self.data[i * n + i];
        }
        b.copy_from_slice(&self.work);
    }
}

/// `out = matrix · x`, for a square matrix given row by row.
pub fn multiply(matrix: &[f64], x: &[f64], out: &mut [f64]) {
    for (row, value) in matrix.chunks_exact(x.len()).zip(out) {
        *value = dot(row, x);
    }
}

/// The inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}
