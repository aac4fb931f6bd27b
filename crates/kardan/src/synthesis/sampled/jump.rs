//! A linear change of the state of a sampled loop at one instant.

use crate::num::Matrix;

/// Rows of z that change at once, over z as it was before.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Jump {
    rows: Vec<(usize, Vec<(usize, f64)>)>,
}

impl Jump {
    pub fn push(&mut self, place: usize, row: Vec<(usize, f64)>) {
        self.rows.push((place, row));
    }

    /// Rows of a matrix from a place on.
    pub fn set(&mut self, first: usize, rows: &Matrix<f64>) {
        for i in 0..rows.rows() {
            let entries = rows.row(i).iter().copied().enumerate().filter(|(_, x)| *x != 0.0);
            self.push(first + i, entries.collect());
        }
    }

    /// `z ← J z`
    pub fn change(&self, z: &mut [f64], memory: &mut Vec<f64>) {
        memory.clear();
        memory.extend(self.rows.iter().map(|(_, row)| row.iter().map(|(j, x)| x * z[*j]).sum::<f64>()));
        self.rows.iter().zip(memory).for_each(|((place, _), value)| z[*place] = *value);
    }

    /// `M ← J M`
    pub fn change_rows(&self, matrix: &mut Matrix<f64>) {
        let columns = matrix.columns();
        let mut new = vec![0.0; self.rows.len() * columns];
        for (out, (_, row)) in new.chunks_exact_mut(columns.max(1)).zip(&self.rows) {
            for (j, x) in row {
                out.iter_mut().zip(matrix.row(*j)).for_each(|(out, entry)| *out += x * entry);
            }
        }
        for (out, (place, _)) in new.chunks_exact(columns.max(1)).zip(&self.rows) {
            (0..columns).for_each(|j| matrix[(*place, j)] = out[j]);
        }
    }
}
