//! A linear change of the state of a sampled loop at one instant.

use kardan_rt::functions::log2;

use kardan_math::num::{Matrix, Rational, Scalar};

/// Rows of z that change at once, over z as it was before.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Jump<S> {
    rows: Vec<(usize, Vec<(usize, S)>)>,
}

impl<S: Scalar> Jump<S> {
    pub fn new() -> Self {
        Self { rows: Vec::new() }
    }

    pub fn push(&mut self, place: usize, row: Vec<(usize, S)>) {
        self.rows.push((place, row));
    }

    /// Rows of a matrix from a place on.
    pub fn set(&mut self, first: usize, rows: &Matrix<S>) {
        for i in 0..rows.rows() {
            self.push(first + i, nonzero(rows.row(i)));
        }
    }

    /// `M ← J M`
    pub fn change_rows(&self, matrix: &mut Matrix<S>) {
        let columns = matrix.columns();
        let mut new = vec![S::zero(); self.rows.len() * columns];
        for (out, (_, row)) in new.chunks_exact_mut(columns.max(1)).zip(&self.rows) {
            for (j, x) in row {
                out.iter_mut().zip(matrix.row(*j)).for_each(|(out, entry)| *out = out.plus(&x.times(entry)));
            }
        }
        for (out, (place, _)) in new.chunks_exact(columns.max(1)).zip(&self.rows) {
            (0..columns).for_each(|j| matrix[(*place, j)] = out[j].clone());
        }
    }
}

impl Jump<Rational> {
    /// log₂ of the largest sum of sizes in a row that changes, rounded up.
    pub fn log_size(&self) -> f64 {
        let rows = self.rows.iter().map(|(_, row)| row.iter().map(|(_, x)| Scalar::to_f64(x).abs()).sum::<f64>());
        log2(rows.fold(0.0, f64::max) * (1.0 + 1e-9))
    }
}

impl Jump<f64> {
    /// The size of its largest entry.
    pub fn largest(&self) -> f64 {
        self.rows.iter().flat_map(|(_, row)| row).fold(0.0, |most, (_, x)| most.max(x.abs()))
    }

    /// The sizes of all its entries.
    pub fn sizes(&self) -> Self {
        let of = |(place, row): &(usize, Vec<(usize, f64)>)| (*place, row.iter().map(|(j, x)| (*j, x.abs())).collect());
        Self { rows: self.rows.iter().map(of).collect() }
    }

    /// `z ← J z`
    pub fn change(&self, z: &mut [f64], memory: &mut Vec<f64>) {
        memory.clear();
        memory.extend(self.rows.iter().map(|(_, row)| row.iter().map(|(j, x)| x * z[*j]).sum::<f64>()));
        self.rows.iter().zip(memory).for_each(|((place, _), value)| z[*place] = *value);
    }
}

/// The entries of a row that are not zero, with their places.
pub(super) fn nonzero<S: Scalar>(row: &[S]) -> Vec<(usize, S)> {
    row.iter().cloned().enumerate().filter(|(_, x)| !x.is_zero()).collect()
}
