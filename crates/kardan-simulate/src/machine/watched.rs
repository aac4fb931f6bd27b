//! Whether multiplier constraints become dependent during a motion.

use kardan_math::num::StateArchive;

/// The determinant of the multiplier constraints over as many coordinates: those in which it was largest at the last
/// evaluation. It changes its sign where the rows become dependent during the motion, and where another choice of
/// coordinates would be regular, which the pivots distinguish.
#[derive(Debug, Clone)]
pub(super) struct WatchedRows {
    /// All coordinates, those of the determinant first.
    columns: Vec<usize>,
    pub(super) matrix: Vec<f64>,
    /// Its sign; zero before the first evaluation.
    pub(super) sign: f64,
    /// The smallest pivot.
    pub(super) least: f64,
}

impl WatchedRows {
    pub(super) fn new(rows: usize, columns: usize) -> Self {
        Self { columns: (0..columns).collect(), matrix: vec![0.0; rows * columns], sign: 0.0, least: 0.0 }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.counts(&mut self.columns);
        archive.number(&mut self.sign);
        archive.number(&mut self.least);
    }

    /// The sign of the determinant and the smallest pivot; with `choose` over the coordinates with the largest pivots, else over those chosen.
    pub(super) fn eliminate(&mut self, choose: bool) -> (f64, f64) {
        let r = self.columns.len();
        let count = self.matrix.len() / r.max(1);
        let (mut sign, mut least) = (1.0, f64::INFINITY);
        for k in 0..count {
            let (mut largest, mut place) = (0.0, (k, k));
            for i in k..count {
                for j in k..if choose { r } else { k + 1 } {
                    let size = self.matrix[i * r + self.columns[j]].abs();
                    if size > largest {
                        (largest, place) = (size, (i, j));
                    }
                }
            }
            least = f64::min(least, largest);
            if largest == 0.0 {
                return (0.0, 0.0);
            }
            self.columns.swap(k, place.1);
            if place.0 != k {
                (0..r).for_each(|j| self.matrix.swap(k * r + j, place.0 * r + j));
                sign = -sign;
            }
            let pivot = self.matrix[k * r + self.columns[k]];
            sign *= pivot.signum();
            for i in k + 1..count {
                let factor = self.matrix[i * r + self.columns[k]] / pivot;
                for j in 0..r {
                    self.matrix[i * r + j] -= factor * self.matrix[k * r + j];
                }
            }
        }
        (sign, least)
    }
}
