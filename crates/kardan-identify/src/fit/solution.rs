//! The least squares problem of a fit, solved within its bounds.

use super::whitened::Whitened;
use super::{FitOptions, Shape};
use crate::Estimate;
use kardan_math::num::dot;

/// Values within their bounds.
pub(super) struct Solution {
    /// Of all columns.
    pub values: Vec<f64>,
    /// Columns that are not at a bound.
    pub free: Vec<usize>,
    /// Of these.
    pub estimate: Estimate,
}

impl Solution {
    pub fn of(data: &Whitened, shapes: &[Option<(f64, Shape)>], weights: &[f64], options: &FitOptions) -> Option<Self> {
        let problem = data.problem(shapes, weights);
        let p = data.columns;
        let bounded: Vec<bool> = (0..p).map(|k| options.nonnegative.get(k).copied().unwrap_or(false)).collect();
        let whole = problem.solve()?;
        let free = if (0..p).any(|k| bounded[k] && whole.values[k] < 0.0) {
            problem.free_of_bounds(&bounded)
        } else {
            (0..p).collect()
        };
        let estimate = if free.len() == p { whole } else { problem.restricted(&free).solve()? };
        let mut values = vec![0.0; p];
        free.iter().zip(&estimate.values).for_each(|(&k, value)| values[k] = *value);
        Some(Self { values, free, estimate })
    }

    /// Columns at their bound.
    pub fn bounded(&self) -> Vec<usize> {
        (0..self.values.len()).filter(|k| !self.free.contains(k)).collect()
    }

    /// Combinations of all columns that the samples do not determine.
    pub fn undetermined(&self) -> Vec<Vec<f64>> {
        let whole = |row: &Vec<f64>| {
            let mut all = vec![0.0; self.values.len()];
            self.free.iter().zip(row).for_each(|(&k, x)| all[k] = *x);
            all
        };
        self.estimate.undetermined.iter().map(whole).collect()
    }
}

/// Root mean square of the residuals, for as many rows as are free.
pub(super) fn scale(data: &Whitened, solution: &Solution, shapes: &[Option<(f64, Shape)>], weights: &[f64]) -> f64 {
    let mut residual = vec![0.0; data.rows];
    let (mut square, mut rows) = (0.0, 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, shapes, &mut residual);
        square += weights[sample] * dot(&residual, &residual);
        rows += f64::from(u8::from(weights[sample] > 0.0)) * data.rows as f64;
    }
    let freedom = rows - solution.estimate.rank as f64;
    if freedom > 0.0 { (square / freedom).sqrt() } else { 0.0 }
}

/// Mean of `e eᵀ` over the samples.
pub(super) fn row_covariance(
    data: &Whitened,
    solution: &Solution,
    shapes: &[Option<(f64, Shape)>],
    weights: &[f64],
) -> Vec<f64> {
    let r = data.rows;
    let (mut residual, mut out, mut sum) = (vec![0.0; r], vec![0.0; r * r], 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, shapes, &mut residual);
        sum += weights[sample];
        (0..r * r).for_each(|k| out[k] += weights[sample] * residual[k / r] * residual[k % r]);
    }
    out.iter_mut().for_each(|x| *x /= sum.max(f64::MIN_POSITIVE));
    out
}
