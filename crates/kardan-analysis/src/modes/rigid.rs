//! Rigid-body modes (motions that stretch no spring), exactly.

use faer::c64;

use crate::ConstrainedSystem;
use kardan_math::num::{Rational, SparseRow, project, rational_to_f64, sparse_echelon, sparse_sum_of_outer};

/// Motions that stretch no spring, over the coordinates.
pub(super) struct Rigid {
    /// Those that also meet no damping.
    pub free: Vec<SparseRow>,
    /// Others, so that both together are a basis.
    pub damped: Vec<SparseRow>,
}

/// The kernel of `S_r`, split by `D_r`, exact. Empty if a stiffness is negative, when springs can cancel each other,
/// and with loads, which can do the same.
pub(super) fn rigid_motions(reduced: &ConstrainedSystem) -> Rigid {
    let n = reduced.coordinates.len();
    let columns: Vec<usize> = (0..n).collect();
    if !reduced.loads.is_empty() || reduced.springs.iter().any(|spring| spring.value < Rational::ZERO) {
        return Rigid { free: Vec::new(), damped: Vec::new() };
    }
    let stretching = reduced.springs.iter().filter(|spring| !spring.value.is_zero()).map(|spring| &spring.row);
    let kernel = kernel_columns(stretching, &columns);
    if kernel.len() > EXACT_RIGID_UP_TO {
        return Rigid { free: Vec::new(), damped: kernel };
    }
    // Rows of D_r Z, one for each coordinate.
    let motions = transposed(&kernel, n);
    let dampers = reduced.dampers.iter().map(|damper| (&damper.row, damper.value.clone()));
    let damping: Vec<SparseRow> = sparse_sum_of_outer(dampers, n).iter().map(|row| project(row, &motions)).collect();
    let numbers: Vec<usize> = (0..kernel.len()).collect();
    let lost = sparse_echelon(&damping, &numbers);
    let combined = |weights: &SparseRow| project(weights, &kernel);
    Rigid {
        free: kernel_columns(&damping, &numbers).iter().map(combined).collect(),
        damped: lost.rows.keys().map(|&k| kernel[k].clone()).collect(),
    }
}

/// A basis of the kernel, one sparse vector for each dimension.
fn kernel_columns<'a>(rows: impl IntoIterator<Item = &'a SparseRow>, columns: &[usize]) -> Vec<SparseRow> {
    let echelon = sparse_echelon(rows, columns);
    let free: Vec<usize> = columns.iter().copied().filter(|j| !echelon.rows.contains_key(j)).collect();
    transposed(&echelon.kernel(columns.len(), &free), free.len())
}

fn transposed(rows: &[SparseRow], columns: usize) -> Vec<SparseRow> {
    let mut out = vec![Vec::new(); columns];
    for (i, row) in rows.iter().enumerate() {
        for (j, x) in row {
            out[*j].push((i, x.clone()));
        }
    }
    out
}

/// Up to this number of rigid motions those without damping are identified exactly.
const EXACT_RIGID_UP_TO: usize = 60;

pub(super) fn dense(row: &SparseRow, length: usize) -> Vec<c64> {
    let mut out = vec![c64::ZERO; length];
    row.iter().for_each(|(i, x)| out[*i] = c64::new(rational_to_f64(x), 0.0));
    out
}
