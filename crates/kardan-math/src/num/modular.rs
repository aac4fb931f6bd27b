//! Matrices over a prime field.

use std::collections::BTreeMap;

use super::{Matrix, PrimeField, Primes, Random, Rational, Reconstruction, Residue};

/// A matrix over a [`PrimeField`], row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ModularMatrix {
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    data: Vec<Residue>,
}

impl ModularMatrix {
    /// Zeros.
    pub fn zeros(rows: usize, columns: usize) -> Self {
        Self { rows, columns, data: vec![0; rows * columns] }
    }

    /// Ones on the diagonal.
    pub fn identity(field: &PrimeField, n: usize) -> Self {
        let mut out = Self::zeros(n, n);
        for i in 0..n {
            out.data[i * n + i] = field.one();
        }
        out
    }

    /// Entry by entry.
    pub fn from_fn(rows: usize, columns: usize, mut f: impl FnMut(usize, usize) -> Residue) -> Self {
        let mut data = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            data.extend((0..columns).map(|j| f(i, j)));
        }
        Self { rows, columns, data }
    }

    /// The image of a rational matrix; `None` if p divides a denominator.
    pub fn from_rational(field: &PrimeField, matrix: &Matrix<Rational>) -> Option<Self> {
        let data = matrix
            .as_slice()
            .iter()
            .map(|x| if x.is_zero() { Some(0) } else { field.rational(x) })
            .collect::<Option<Vec<_>>>()?;
        Some(Self { rows: matrix.rows(), columns: matrix.columns(), data })
    }

    /// Uniform entries.
    pub fn random(field: &PrimeField, rows: usize, columns: usize, random: &mut Random) -> Self {
        Self::from_fn(rows, columns, |_, _| random.below(field.prime()))
    }

    /// Row `i`.
    pub fn row(&self, i: usize) -> &[Residue] {
        &self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Row `i`.
    pub fn row_mut(&mut self, i: usize) -> &mut [Residue] {
        &mut self.data[i * self.columns..(i + 1) * self.columns]
    }

    /// Column `j`.
    pub fn column(&self, j: usize) -> Vec<Residue> {
        (0..self.rows).map(|i| self.data[i * self.columns + j]).collect()
    }

    /// The transpose.
    pub fn transpose(&self) -> Self {
        Self::from_fn(self.columns, self.rows, |i, j| self.data[j * self.columns + i])
    }

    /// `self · x`.
    pub fn apply(&self, field: &PrimeField, x: &[Residue]) -> Vec<Residue> {
        (0..self.rows).map(|i| field.dot(self.row(i), x)).collect()
    }

    /// Where each row has entries.
    fn filled(&self) -> Vec<Vec<usize>> {
        let places = |row: &[Residue]| (0..row.len()).filter(|&j| row[j] != 0).collect();
        (0..self.rows).map(|i| places(self.row(i))).collect()
    }

    /// `self · other`.
    pub fn multiply(&self, field: &PrimeField, other: &Self) -> Self {
        let mut out = Self::zeros(self.rows, other.columns);
        let (mut columns, mut filled) = (None, None);
        for i in 0..self.rows {
            let row = self.row(i);
            if 4 * row.iter().filter(|&&x| x != 0).count() < row.len() {
                let filled = filled.get_or_insert_with(|| other.filled());
                for (k, &x) in row.iter().enumerate().filter(|(_, x)| **x != 0) {
                    for &j in &filled[k] {
                        let target = &mut out.data[i * other.columns + j];
                        *target = field.plus(*target, field.times(x, other.row(k)[j]));
                    }
                }
            } else {
                let columns = columns.get_or_insert_with(|| other.transpose());
                for (j, x) in out.row_mut(i).iter_mut().enumerate() {
                    *x = field.dot(row, columns.row(j));
                }
            }
        }
        out
    }

    /// `self + factor · other`.
    pub fn plus(&self, field: &PrimeField, factor: Residue, other: &Self) -> Self {
        let mut out = self.clone();
        field.subtract(&mut out.data, field.negate(factor), &other.data);
        out
    }

    /// The solution X of `self · X = right` and the determinant of `self`; `None` if it is singular.
    pub fn solve(&self, field: &PrimeField, right: &Self) -> Option<(Self, Residue)> {
        let (n, width) = (self.rows, self.columns + right.columns);
        let mut joined =
            Self::from_fn(
                n,
                width,
                |i, j| {
                    if j < n { self.data[i * n + j] } else { right.data[i * right.columns + j - n] }
                },
            );
        let determinant = joined.diagonalise(field)?;
        Some((Self::from_fn(n, right.columns, |i, j| joined.data[i * width + n + j]), determinant))
    }

    /// The inverse and the determinant, in the memory of the matrix; `None` if it is singular.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn inverse(mut self, field: &PrimeField) -> Option<(Self, Residue)> {
        assert_eq!(self.rows, self.columns, "the inverse of a matrix that is not square");
        let n = self.rows;
        let (mut determinant, mut order) = (field.one(), (0..n).collect::<Vec<_>>());
        for k in 0..n {
            let pivot = (k..n).find(|&i| self.data[i * n + k] != 0)?;
            if pivot != k {
                self.swap(pivot, k);
                order.swap(pivot, k);
                determinant = field.negate(determinant);
            }
            // What the same operations make of column k of the identity.
            let column = self.column(k);
            determinant = field.times(determinant, column[k]);
            let inverse = self.clear(field, k, k, 0);
            for (i, x) in column.into_iter().enumerate() {
                self.data[i * n + k] = if i == k { inverse } else { field.negate(field.times(x, inverse)) };
            }
        }
        // Rows that were exchanged are columns of the inverse.
        for i in 0..n {
            let row = self.row(i).to_vec();
            order.iter().zip(row).for_each(|(&j, x)| self.data[i * n + j] = x);
        }
        Some((self, determinant))
    }

    /// The determinant.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn determinant(&self, field: &PrimeField) -> Residue {
        assert_eq!(self.rows, self.columns, "the determinant of a matrix that is not square");
        self.clone().diagonalise(field).unwrap_or(0)
    }

    /// Brings the square of the first columns to the identity by operations on whole rows, and gives its determinant; `None` if that is zero.
    fn diagonalise(&mut self, field: &PrimeField) -> Option<Residue> {
        let mut determinant = field.one();
        for k in 0..self.rows {
            let pivot = (k..self.rows).find(|&i| self.data[i * self.columns + k] != 0)?;
            if pivot != k {
                self.swap(pivot, k);
                determinant = field.negate(determinant);
            }
            determinant = field.times(determinant, self.data[k * self.columns + k]);
            self.clear(field, k, k, k);
        }
        Some(determinant)
    }

    /// Exchanges two rows.
    fn swap(&mut self, i: usize, j: usize) {
        for k in 0..self.columns {
            self.data.swap(i * self.columns + k, j * self.columns + k);
        }
    }

    /// Divides row `pivot` by its entry in `column` and clears that column in all other rows; entries left of `from` of
    /// the pivot row are zero. Gives one over that entry.
    fn clear(&mut self, field: &PrimeField, pivot: usize, column: usize, from: usize) -> Residue {
        let width = self.columns;
        let size = self.data[pivot * width + column];
        let mut inverse = size;
        if size != field.one() {
            inverse = field.inverse(size);
            let row = &mut self.data[pivot * width + from..(pivot + 1) * width];
            row.iter_mut().filter(|x| **x != 0).for_each(|x| *x = field.times(*x, inverse));
        }
        let row = self.data[pivot * width + from..(pivot + 1) * width].to_vec();
        let filled: Vec<usize> = (0..row.len()).filter(|&j| row[j] != 0).collect();
        for i in 0..self.rows {
            let factor = self.data[i * width + column];
            if i == pivot || factor == 0 {
                continue;
            }
            let target = &mut self.data[i * width + from..(i + 1) * width];
            if 4 * filled.len() < row.len() {
                for &j in &filled {
                    target[j] = field.minus(target[j], field.times(factor, row[j]));
                }
            } else {
                field.subtract(target, factor, &row);
            }
        }
        inverse
    }

    /// Brings the matrix to reduced row echelon form, drops zero rows and gives the pivot columns.
    pub fn echelon(mut self, field: &PrimeField) -> (Self, Vec<usize>) {
        let mut pivots = Vec::new();
        for column in 0..self.columns {
            let rank = pivots.len();
            let Some(pivot) = (rank..self.rows).find(|&i| self.data[i * self.columns + column] != 0) else { continue };
            self.swap(rank, pivot);
            self.clear(field, rank, column, column);
            pivots.push(column);
        }
        self.rows = pivots.len();
        self.data.truncate(self.rows * self.columns);
        (self, pivots)
    }

    /// A basis of `{x : self · x = 0}`, one row per vector, in reduced row echelon form read from the right.
    pub fn null_space(self, field: &PrimeField) -> Self {
        let n = self.columns;
        let (form, pivots) = self.echelon(field);
        let free: Vec<usize> = (0..n).filter(|j| !pivots.contains(j)).collect();
        let mut out = Self::zeros(free.len(), n);
        for (k, &j) in free.iter().enumerate() {
            out.data[k * n + j] = field.one();
            for (i, &pivot) in pivots.iter().enumerate() {
                out.data[k * n + pivot] = field.negate(form.data[i * n + j]);
            }
        }
        out
    }

    /// Coefficients of `det(xI − self)`, of 1, x, x², …; leading coefficient one.
    ///
    /// Method: similarity to Hessenberg form, then the recursion on its leading minors; O(n³).
    pub fn characteristic_polynomial(&self, field: &PrimeField) -> Vec<Residue> {
        let n = self.rows;
        let mut h = self.clone();
        for k in 1..n.saturating_sub(1) {
            let Some(pivot) = (k..n).find(|&i| h.data[i * n + k - 1] != 0) else { continue };
            if pivot != k {
                h.swap(pivot, k);
                for i in 0..n {
                    h.data.swap(i * n + pivot, i * n + k);
                }
            }
            let inverse = field.inverse(h.data[k * n + k - 1]);
            let row = h.row(k).to_vec();
            let mut factors = vec![0; n];
            for i in k + 1..n {
                let factor = field.times(h.data[i * n + k - 1], inverse);
                if factor != 0 {
                    field.subtract(&mut h.data[i * n..(i + 1) * n], factor, &row);
                    factors[i] = factor;
                }
            }
            for i in 0..n {
                let sum = field.dot(&h.data[i * n + k + 1..(i + 1) * n], &factors[k + 1..]);
                h.data[i * n + k] = field.plus(h.data[i * n + k], sum);
            }
        }
        // p_k(x) = (x − h_kk) p_{k−1} − Σ_j h_jk (Π_{i=j+1..k} h_{i,i−1}) p_{j−1}
        let mut polynomials: Vec<Vec<Residue>> = vec![vec![field.one()]];
        for k in 0..n {
            let mut next = vec![0; k + 2];
            next[1..].copy_from_slice(&polynomials[k]);
            let mut product = field.one();
            for j in (0..=k).rev() {
                let factor = field.times(h.data[j * n + k], product);
                field.subtract(&mut next, factor, &polynomials[j]);
                if j > 0 {
                    product = field.times(product, h.data[j * n + j - 1]);
                }
            }
            polynomials.push(next);
        }
        polynomials.swap_remove(n)
    }
}

/// The rank of a rational matrix, exact.
///
/// A minor that does not vanish modulo a prime proves that the rank is not smaller. Null vectors, found modulo primes, brought
/// back to fractions and checked, prove that it is not larger. Cost: O(n³) for a regular matrix; otherwise that for each of as
/// many primes as the fractions need.
///
/// ```
/// use kardan_math::num::{Matrix, Rational, exact_rank};
/// let p = Rational::from((1u64 << 61) - 1);
/// let m = Matrix::from_fn(2, 2, |i, j| if i == j { p.clone() } else { Rational::ZERO });
/// assert_eq!((exact_rank(&m), exact_rank(&Matrix::from_fn(2, 3, |_, _| p.clone()))), (2, 1));
/// ```
pub fn exact_rank(matrix: &Matrix<Rational>) -> usize {
    let (rows, columns) = (matrix.rows(), matrix.columns());
    let (mut best, mut groups) = (0, BTreeMap::<Vec<usize>, (Reconstruction, usize)>::new());
    for prime in Primes::new(1) {
        let field = PrimeField::new(prime);
        let Some(image) = ModularMatrix::from_rational(&field, matrix) else { continue };
        let (form, pivots) = image.echelon(&field);
        let rank = pivots.len();
        if rank == rows.min(columns) {
            return rank;
        }
        if rank < best {
            continue;
        }
        if rank > best {
            (best, groups) = (rank, BTreeMap::new());
        }
        let free: Vec<usize> = (0..columns).filter(|j| !pivots.contains(j)).collect();
        let values = (0..rank).flat_map(|i| free.iter().map(move |&j| (i, j)));
        let values: Vec<u64> = values.map(|(i, j)| field.value(form.row(i)[j])).collect();
        let (reconstruction, primes) = groups.entry(pivots.clone()).or_insert_with(|| (Reconstruction::new(), 0));
        reconstruction.add(prime, &values);
        *primes += 1;
        let Some(found) = primes.is_power_of_two().then(|| reconstruction.fractions()).flatten() else { continue };
        // Column j is that combination of the pivot columns.
        let depends = |k: usize, i: usize| {
            let sum =
                (0..rank).fold(Rational::ZERO, |sum, l| sum + &matrix[(i, pivots[l])] * &found[l * free.len() + k]);
            sum == matrix[(i, free[k])]
        };
        if (0..free.len()).all(|k| (0..rows).all(|i| depends(k, i))) {
            return rank;
        }
    }
    unreachable!("there are more primes than any fraction needs")
}

#[cfg(test)]
#[path = "../../tests/unit/num/modular.rs"]
mod tests;
