//! Least squares over any number of rows, stored as a triangular factor.

use faer::{Mat, MatRef};
use kardan_rt::functions::powi;

use kardan_math::num::Matrix;

/// Rows that are collected before they are triangularised.
const ROWS: usize = 256;
/// Singular value over the largest one, columns scaled to one, below which a direction is determined only by rounding and by
/// the filter residue of a motion.
const ROUNDING: f64 = 1e-7;

/// A least-squares problem `min ‖W(Xθ − y)‖` in memory that does not grow with its rows: it stores the triangular factor of
/// `[WX Wy]`, brought up to date by QR decompositions (`faer`; Golub, Van Loan 2013, 5.2 and 6.5), never the normal equations.
#[derive(Debug, Clone)]
pub struct LeastSquares {
    columns: usize,
    /// The factor, then rows that wait: row by row, columns + 1 entries each.
    rows: Vec<f64>,
    waiting: usize,
    count: usize,
}

/// Solution of a least-squares problem.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// θ; for undetermined directions the values of the smallest norm, columns scaled to one.
    pub values: Vec<f64>,
    /// Standard errors; infinite for undetermined values.
    pub standard_errors: Vec<f64>,
    /// Correlations of the errors.
    pub correlation: Matrix<f64>,
    /// `(XᵀWWX)⁻¹` (of the determined part): times the square of the residual the covariance of θ.
    pub cofactor: Matrix<f64>,
    /// Root mean square of the residuals, `√(‖W(Xθ − y)‖² / (rows − rank))`.
    pub residual: f64,
    /// Rows.
    pub rows: usize,
    /// Numerical rank of X.
    pub rank: usize,
    /// Largest over smallest singular value of X with columns scaled to one.
    pub condition: f64,
    /// Combinations of θ that the rows do not determine, of length one in scaled columns: one row for each.
    pub undetermined: Vec<Vec<f64>>,
}

impl LeastSquares {
    /// A problem with this number of unknowns.
    pub fn new(columns: usize) -> Self {
        Self { columns, rows: vec![0.0; (columns + 1) * (columns + 1)], waiting: 0, count: 0 }
    }

    /// Adds a row `w x θ = w y`.
    ///
    /// # Panics
    /// If x has not one entry for each unknown.
    pub fn add(&mut self, x: &[f64], y: f64, weight: f64) {
        assert_eq!(x.len(), self.columns, "one entry for each unknown");
        self.rows.extend(x.iter().map(|x| weight * x));
        self.rows.push(weight * y);
        self.waiting += 1;
        self.count += 1;
        if self.waiting == ROWS {
            self.triangularise();
        }
    }

    /// Adds the rows of another problem with the same unknowns.
    ///
    /// # Panics
    /// If it has others.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(self.columns, other.columns, "the same unknowns");
        let count = self.count + other.count;
        for row in other.rows.chunks_exact(self.columns + 1) {
            self.add(&row[..self.columns], row[self.columns], 1.0);
        }
        self.count = count;
    }

    /// Rows added.
    pub fn count(&self) -> usize {
        self.count
    }

    /// The same problem with only some of its unknowns, in this order; the others are zero.
    ///
    /// # Panics
    /// If a number is not that of an unknown.
    pub fn restricted(&self, unknowns: &[usize]) -> Self {
        let mut out = Self::new(unknowns.len());
        let mut x = vec![0.0; unknowns.len()];
        for row in self.rows.chunks_exact(self.columns + 1) {
            x.iter_mut().zip(unknowns).for_each(|(x, &k)| *x = row[k]);
            out.add(&x, row[self.columns], 1.0);
        }
        out.count = self.count;
        out
    }

    /// The values of some unknowns that minimise the residual while others (`bounded`) are not below zero \[Lawson, Hanson 1974,
    /// 23.3\]: those that are free of their bound. Every unknown that is not bounded is free.
    pub fn free_of_bounds(&self, bounded: &[bool]) -> Vec<usize> {
        let p = self.columns;
        let mut free: Vec<bool> = bounded.iter().map(|bounded| !bounded).collect();
        let mut values = vec![0.0; p];
        let numbers = |free: &[bool]| (0..p).filter(|&k| free[k]).collect::<Vec<_>>();
        let solved = |free: &[bool]| -> Option<Vec<f64>> {
            let mut out = vec![0.0; p];
            let list = numbers(free);
            if list.is_empty() {
                return Some(out);
            }
            let found = self.restricted(&list).solve()?;
            list.iter().zip(&found.values).for_each(|(&k, value)| out[k] = *value);
            Some(out)
        };
        if let Some(found) = solved(&free) {
            values = found;
        }
        // Each round frees one; a few times their number bounds what rounding could repeat.
        for _ in 0..3 * p + 3 {
            let slopes = self.slopes(&values);
            let next = (0..p)
                .filter(|&k| !free[k] && slopes[k].0 > 1e-12 * slopes[k].1)
                .max_by(|&a, &b| (slopes[a].0 / slopes[a].1).total_cmp(&(slopes[b].0 / slopes[b].1)));
            let Some(next) = next else { break };
            free[next] = true;
            // Each pass fixes at least one of the free ones.
            for _ in 0..=p {
                let Some(solution) = solved(&free) else { return numbers(&free) };
                let is_blocking = |k: &usize| bounded[*k] && free[*k] && solution[*k] <= 0.0;
                let step = (0..p)
                    .filter(is_blocking)
                    .map(|k| values[k] / (values[k] - solution[k]))
                    .filter(|step| step.is_finite())
                    .fold(1.0, f64::min);
                let blocked: Vec<usize> = (0..p).filter(is_blocking).collect();
                for k in 0..p {
                    values[k] += step * (solution[k] - values[k]);
                }
                if blocked.is_empty() {
                    break;
                }
                let at_bound = |k: &usize| !(values[*k] > 1e-14 * solution[*k].abs());
                let nearest = blocked.iter().copied().min_by(|&a, &b| values[a].total_cmp(&values[b]));
                let at_bound: Vec<usize> = blocked.iter().copied().filter(at_bound).collect();
                for k in if at_bound.is_empty() { nearest.into_iter().collect() } else { at_bound } {
                    values[k] = 0.0;
                    free[k] = false;
                }
            }
        }
        numbers(&free)
    }

    /// `Xᵀ(y − Xθ)` and the size of its parts, for each unknown.
    fn slopes(&self, values: &[f64]) -> Vec<(f64, f64)> {
        let mut out = vec![(0.0, 0.0); self.columns];
        for row in self.rows.chunks_exact(self.columns + 1) {
            let residual = row[self.columns] - kardan_math::num::dot(&row[..self.columns], values);
            for (sum, x) in out.iter_mut().zip(row) {
                sum.0 += x * residual;
                sum.1 += x.abs() * (row[self.columns].abs() + residual.abs());
            }
        }
        out
    }

    fn triangularise(&mut self) {
        let n = self.columns + 1;
        let all = MatRef::from_row_major_slice(&self.rows, self.rows.len() / n, n);
        let found = all.qr();
        let factor = found.thin_R();
        self.rows = (0..n * n).map(|k| if k % n >= k / n { factor[(k / n, k % n)] } else { 0.0 }).collect();
        self.waiting = 0;
    }

    /// Solves it. `None` without rows, or if a number is not finite.
    ///
    /// Method: singular values (`faer`) of the factor with columns scaled to one.
    pub fn solve(&self) -> Option<Estimate> {
        let (p, n) = (self.columns, self.columns + 1);
        if self.count == 0 || !self.rows.iter().all(|x| x.is_finite()) {
            return None;
        }
        let mut own = self.clone();
        own.triangularise();
        let entry = |i: usize, j: usize| own.rows[i * n + j];
        let scales: Vec<f64> = (0..p)
            .map(|j| {
                let norm = (0..=j).map(|i| powi(entry(i, j), 2)).sum::<f64>().sqrt();
                if norm > 0.0 { norm } else { 1.0 }
            })
            .collect();
        let scaled = Mat::from_fn(p, p, |i, j| if i <= j { entry(i, j) / scales[j] } else { 0.0 });
        let svd = scaled.svd().ok()?;
        let (left, right) = (svd.U(), svd.V());
        let singular: Vec<f64> = (0..p).map(|k| svd.S()[k]).collect();
        let largest = singular.iter().copied().fold(0.0, f64::max);
        let is_determined = |k: usize| singular[k] > ROUNDING * largest && singular[k] > 0.0;
        let rank = (0..p).filter(|&k| is_determined(k)).count();
        let mut values = vec![0.0; p];
        // The residual of the factor, and the part of y along undetermined directions.
        let mut square = powi(entry(p, p), 2);
        for k in 0..p {
            let projection: f64 = (0..p).map(|i| left[(i, k)] * entry(i, p)).sum();
            if is_determined(k) {
                (0..p).for_each(|j| values[j] += right[(j, k)] * projection / singular[k]);
            } else {
                square += projection * projection;
            }
        }
        let freedom = self.count.saturating_sub(rank);
        let residual = if freedom > 0 { (square / freedom as f64).sqrt() } else { 0.0 };
        let covariance = Matrix::from_fn(p, p, |i, j| {
            let all = (0..p).filter(|&k| is_determined(k));
            all.map(|k| right[(i, k)] * right[(j, k)] / powi(singular[k], 2)).sum::<f64>()
        });
        let lost = |j: usize| (0..p).any(|k| !is_determined(k) && right[(j, k)].abs() > ROUNDING.sqrt());
        let errors: Vec<f64> = (0..p)
            .map(|j| if lost(j) { f64::INFINITY } else { residual * covariance[(j, j)].sqrt() / scales[j] })
            .collect();
        let spread = |i: usize| covariance[(i, i)].sqrt();
        Some(Estimate {
            values: values.iter().zip(&scales).map(|(value, scale)| value / scale).collect(),
            standard_errors: errors,
            correlation: Matrix::from_fn(p, p, |i, j| {
                let both = spread(i) * spread(j);
                if i == j || both == 0.0 { f64::from(u8::from(i == j)) } else { covariance[(i, j)] / both }
            }),
            cofactor: Matrix::from_fn(p, p, |i, j| covariance[(i, j)] / (scales[i] * scales[j])),
            residual,
            rows: self.count,
            rank,
            condition: largest / singular.iter().copied().fold(f64::INFINITY, f64::min),
            undetermined: (0..p)
                .filter(|&k| !is_determined(k))
                .map(|k| (0..p).map(|j| right[(j, k)] / scales[j]).collect())
                .collect(),
        })
    }
}
