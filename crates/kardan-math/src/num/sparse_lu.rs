//! LU factors of sparse matrices of real or complex numbers.

use std::ops::{Add, Mul, Sub};

use faer::c64;

/// Pivots that cancel to less than this part of their terms are taken for zero.
const VANISHING: f64 = 1e-13;

/// Numbers that are eliminated with.
pub trait Field: Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {
    /// About the absolute value.
    fn size(self) -> f64;
    /// The inverse.
    fn inverse(self) -> Self;
}

impl Field for f64 {
    fn size(self) -> f64 {
        self.abs()
    }

    fn inverse(self) -> Self {
        1.0 / self
    }
}

impl Field for c64 {
    fn size(self) -> f64 {
        self.re.abs() + self.im.abs()
    }

    fn inverse(self) -> Self {
        self.inv()
    }
}

/// Where the numbers of a sparse matrix and of its factors are: the order of elimination, found from the places alone.
///
/// Pivots are taken from the diagonal, always where the fewest numbers change (Markowitz 1957), and never where the diagonal has no number
/// yet. So the factors of a chain or a tree take memory and time in proportion to its length, and the same places
/// always give the same order. No row is exchanged for the size of its numbers: a pivot that cancels is reported when numbers are factored.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseOrder {
    /// The row (and column) of each pivot.
    pivots: Vec<usize>,
    /// For each given number its row and column in the order of the pivots, sorted by rows; and which it is.
    entries: Vec<(usize, usize, usize)>,
    /// Right of the diagonal: where each row of U begins, and its columns.
    starts: Vec<usize>,
    columns: Vec<usize>,
    /// Left of it: where each row of L begins, and its columns.
    lower_starts: Vec<usize>,
    lower_columns: Vec<usize>,
}

/// The numbers of the bits that are set, but for one.
fn set_bits(bits: &[u64], but: usize) -> Vec<usize> {
    let set = |(word, bits): (usize, &u64)| {
        let bits = *bits;
        (0..64).filter(move |bit| bits >> bit & 1 == 1).map(move |bit| word * 64 + bit)
    };
    bits.iter().enumerate().flat_map(set).filter(|i| *i != but).collect()
}

impl SparseOrder {
    /// For a matrix of n rows with numbers at these places (row, column), of which numbers at the same one add up. `None` if some place of
    /// the diagonal stays empty to the end.
    ///
    /// # Panics
    /// If a place is outside.
    pub fn new(n: usize, places: &[(usize, usize)]) -> Option<Self> {
        let row_length = n.div_ceil(64);
        // Which columns each row has, and which rows each column, of those that are left.
        let (mut rows, mut columns) = (vec![0u64; n * row_length], vec![0u64; n * row_length]);
        for &(i, j) in places {
            assert!(i < n && j < n, "place ({i}, {j}) of a matrix of {n} rows");
            rows[i * row_length + j / 64] |= 1 << (j % 64);
            columns[j * row_length + i / 64] |= 1 << (i % 64);
        }
        let row_of = |bits: &[u64], i: usize| bits[i * row_length..(i + 1) * row_length].to_vec();
        let cost = |rows: &[u64], columns: &[u64], i: usize| {
            let count = |bits: &[u64]| {
                bits[i * row_length..(i + 1) * row_length].iter().map(|w| u64::from(w.count_ones())).sum::<u64>()
            };
            (count(rows).max(1) - 1) * (count(columns).max(1) - 1)
        };
        let mut costs: Vec<u64> = (0..n).map(|i| cost(&rows, &columns, i)).collect();
        let mut left: Vec<usize> = (0..n).collect();
        let (mut pivots, mut upper, mut lower) = (Vec::with_capacity(n), Vec::with_capacity(n), Vec::with_capacity(n));
        while !left.is_empty() {
            let able =
                left.iter().enumerate().filter(|(_, i)| rows[**i * row_length + **i / 64] >> (**i % 64) & 1 == 1);
            let (place, &pivot) = able.min_by_key(|(_, i)| (costs[**i], **i))?;
            left.remove(place);
            let (own_row, own_column) = (row_of(&rows, pivot), row_of(&columns, pivot));
            let (right, below) = (set_bits(&own_row, pivot), set_bits(&own_column, pivot));
            for (bits, at, own) in [(&mut rows, &below, &own_row), (&mut columns, &right, &own_column)] {
                for i in at {
                    let target = &mut bits[i * row_length..(i + 1) * row_length];
                    target.iter_mut().zip(own).for_each(|(target, own)| *target |= own);
                    target[pivot / 64] &= !(1 << (pivot % 64));
                }
            }
            right.iter().chain(&below).for_each(|i| costs[*i] = cost(&rows, &columns, *i));
            pivots.push(pivot);
            upper.push(right);
            lower.push(below);
        }
        let mut position = vec![0; n];
        pivots.iter().enumerate().for_each(|(k, pivot)| position[*pivot] = k);
        let mut entries: Vec<(usize, usize, usize)> =
            places.iter().enumerate().map(|(number, &(i, j))| (position[i], position[j], number)).collect();
        entries.sort_unstable();
        let (mut starts, mut columns) = (vec![0], Vec::new());
        for right in &upper {
            let mut row: Vec<usize> = right.iter().map(|j| position[*j]).collect();
            row.sort_unstable();
            columns.extend(row);
            starts.push(columns.len());
        }
        let mut left = vec![Vec::new(); n];
        for (k, below) in lower.iter().enumerate() {
            below.iter().for_each(|i| left[position[*i]].push(k));
        }
        let mut lower_starts = vec![0];
        left.iter().for_each(|row| lower_starts.push(lower_starts[lower_starts.len() - 1] + row.len()));
        Some(Self { pivots, entries, starts, columns, lower_starts, lower_columns: left.concat() })
    }

    /// How many numbers the factors have.
    pub fn size(&self) -> usize {
        self.columns.len() + self.lower_columns.len() + self.pivots.len()
    }
}

/// The factors of a matrix, `P M Pᵀ = L U`.
///
/// ```
/// use kardan_math::num::{SparseLu, SparseOrder};
///
/// let order = SparseOrder::new(2, &[(0, 0), (0, 1), (1, 0), (1, 1)]).unwrap();
/// let mut lu = SparseLu::default();
/// assert!(lu.factor(&order, &[2.0, 1.0, 1.0, 3.0]));
///
/// let mut x = [3.0, 4.0];
/// lu.solve(&order, &mut x);
/// assert_eq!(x, [1.0, 1.0]);
/// ```
#[derive(Debug, Clone, Default)]
pub struct SparseLu<T> {
    lower: Vec<T>,
    upper: Vec<T>,
    /// One over each pivot.
    inverses: Vec<T>,
    work: Vec<T>,
}

impl<T: Field> SparseLu<T> {
    /// Factors the matrix with these numbers at the places that the order was found for; false if a pivot cancels.
    ///
    /// # Panics
    /// If there are fewer numbers than places.
    pub fn factor(&mut self, order: &SparseOrder, numbers: &[T]) -> bool {
        let n = order.pivots.len();
        let Self { lower, upper, inverses, work } = self;
        lower.resize(order.lower_columns.len(), T::default());
        upper.resize(order.columns.len(), T::default());
        inverses.resize(n, T::default());
        work.clear();
        work.resize(n, T::default());
        let mut entries = order.entries.iter().peekable();
        for k in 0..n {
            while let Some((_, column, number)) = entries.next_if(|(row, ..)| *row == k) {
                work[*column] = work[*column] + numbers[*number];
            }
            let mut largest = work[k].size();
            for at in order.lower_starts[k]..order.lower_starts[k + 1] {
                let j = order.lower_columns[at];
                let factor = work[j] * inverses[j];
                (lower[at], work[j]) = (factor, T::default());
                let before = work[k];
                let row = order.starts[j]..order.starts[j + 1];
                for (column, entry) in order.columns[row.clone()].iter().zip(&upper[row]) {
                    work[*column] = work[*column] - factor * *entry;
                }
                largest = largest.max((work[k] - before).size());
            }
            let pivot = work[k];
            if !(pivot.size() > VANISHING * largest) {
                return false;
            }
            (inverses[k], work[k]) = (pivot.inverse(), T::default());
            let row = order.starts[k]..order.starts[k + 1];
            for (column, entry) in order.columns[row.clone()].iter().zip(&mut upper[row]) {
                (*entry, work[*column]) = (work[*column], T::default());
            }
        }
        true
    }

    /// Overwrites `b` with `M⁻¹ b`.
    pub fn solve(&mut self, order: &SparseOrder, b: &mut [T]) {
        let Self { lower, upper, inverses, work } = self;
        for (k, pivot) in order.pivots.iter().enumerate() {
            let row = order.lower_starts[k]..order.lower_starts[k + 1];
            let terms = order.lower_columns[row.clone()].iter().zip(&lower[row]);
            work[k] = terms.fold(b[*pivot], |sum, (j, entry)| sum - *entry * work[*j]);
        }
        for (k, pivot) in order.pivots.iter().enumerate().rev() {
            let row = order.starts[k]..order.starts[k + 1];
            let terms = order.columns[row.clone()].iter().zip(&upper[row]);
            work[k] = terms.fold(work[k], |sum, (j, entry)| sum - *entry * work[*j]) * inverses[k];
            b[*pivot] = work[k];
        }
    }
}

#[cfg(test)]
#[path = "../../tests/unit/num/sparse_lu.rs"]
mod tests;
