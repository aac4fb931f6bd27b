//! Whether the bound of a cell is a contraction, and otherwise in which direction the cell is to be divided.

use super::cells::Cells;

/// Division of λ makes four cells, of a parameter two.
const LAMBDA_WEIGHT: f64 = 0.5;

impl Cells {
    /// Whether a positive vector d with `G d < d` is found: from `(I − G) d = 1`, then checked.
    ///
    /// Without one, leaves Perron's vectors of G (roughly) in `right` and `left`.
    pub(super) fn is_contraction(&mut self) -> bool {
        let n = self.n;
        if self.positive_solution() {
            self.apply_to_right();
            let d = &self.right;
            let contracts = (0..n).all(|i| d[i] >= 0.5 && d[i] <= 1e15 && self.work[i] * (1.0 + self.slack) < d[i]);
            if contracts {
                return true;
            }
        }
        self.right.fill(1.0);
        self.left.fill(1.0);
        for _ in 0..12 {
            for j in 0..n {
                self.work[j] = 0.0;
                for i in 0..n {
                    self.work[j] += self.left[i] * self.bound[j * n + i];
                }
            }
            normalise(&mut self.left, &self.work);
            self.apply_to_right();
            normalise(&mut self.right, &self.work);
        }
        false
    }

    /// G times `right`, into `work`.
    fn apply_to_right(&mut self) {
        self.work.fill(0.0);
        for (column, x) in self.bound.chunks_exact(self.n).zip(&self.right) {
            self.work.iter_mut().zip(column).for_each(|(sum, g)| *sum += g * x);
        }
    }

    /// Solves `(I − G) d = 1` into `right` without pivoting; whether all pivots are positive, as for a spectral radius below one.
    fn positive_solution(&mut self) -> bool {
        let n = self.n;
        let a = &mut self.triangular;
        for j in 0..n {
            for i in 0..n {
                a[j * n + i] = f64::from(u8::from(i == j)) - self.bound[j * n + i];
            }
        }
        let d = &mut self.right;
        d.fill(1.0);
        for k in 0..n {
            let pivot = a[k * n + k];
            if !(pivot > 1e-14) {
                return false;
            }
            let (before, after) = a.split_at_mut((k + 1) * n);
            let eliminated = &mut before[k * n..];
            for i in k + 1..n {
                eliminated[i] /= pivot;
                d[i] -= eliminated[i] * d[k];
            }
            for column in after.chunks_exact_mut(n) {
                let top = column[k];
                for i in k + 1..n {
                    column[i] -= eliminated[i] * top;
                }
            }
        }
        for k in (0..n).rev() {
            d[k] /= a[k * n + k];
            for i in 0..k {
                d[i] -= a[k * n + i] * d[k];
            }
        }
        true
    }

    /// The direction to divide: the parameter that contributes most to the spectral radius, or λ.
    pub(super) fn direction(&mut self) -> Option<usize> {
        let n = self.n;
        self.contributions.fill(0.0);
        for (index, (parameter, column)) in self.slope_columns.iter().enumerate() {
            let part = &self.slopes[index * n..(index + 1) * n];
            let sum: f64 = part.iter().zip(&self.left).map(|(x, y)| x * y).sum();
            self.contributions[*parameter] += sum * self.right[column.column];
        }
        let q = self.centre.len();
        self.contributions[q] = LAMBDA_WEIGHT * self.weigh(&self.lambda);
        let mut best = q;
        for i in 0..q {
            if self.contributions[i] > self.contributions[best] {
                best = i;
            }
        }
        (best < q).then_some(best)
    }

    /// Whether what division cannot make smaller is too large.
    pub(super) fn hopeless(&self) -> bool {
        let size: f64 = self.right.iter().zip(&self.left).map(|(x, y)| x * y).sum();
        !(self.weigh(&self.floor) < 0.5 * size)
    }

    fn weigh(&self, part: &[f64]) -> f64 {
        let rows = part.chunks_exact(self.n).zip(&self.right);
        rows.map(|(column, x)| x * column.iter().zip(&self.left).map(|(g, y)| g * y).sum::<f64>()).sum()
    }
}

/// A positive vector with largest entry one; none is far below.
fn normalise(vector: &mut [f64], raw: &[f64]) {
    let largest = raw.iter().copied().fold(0.0, f64::max);
    for (x, raw) in vector.iter_mut().zip(raw) {
        *x = f64::max(raw / largest, 1e-8);
    }
}
