//! The least squares problem of a fit, solved within its bounds.

use super::FitOptions;
use super::whitened::Whitened;
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
    pub fn of(data: &Whitened, options: &FitOptions) -> Option<Self> {
        let problem = data.problem();
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
pub(super) fn scale(data: &Whitened, solution: &Solution) -> f64 {
    let mut residual = vec![0.0; data.rows];
    let (mut square, mut rows) = (0.0, 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, &mut residual);
        square += data.weights[sample] * dot(&residual, &residual);
        rows += f64::from(u8::from(data.weights[sample] > 0.0)) * data.rows as f64;
    }
    let freedom = rows - solution.estimate.rank as f64;
    if freedom > 0.0 { (square / freedom).sqrt() } else { 0.0 }
}

/// Mean of `e eᵀ` over the samples.
pub(super) fn row_covariance(data: &Whitened, solution: &Solution) -> Vec<f64> {
    let r = data.rows;
    let (mut residual, mut out, mut sum) = (vec![0.0; r], vec![0.0; r * r], 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, &mut residual);
        let weight = data.weights[sample];
        sum += weight;
        (0..r * r).for_each(|k| out[k] += weight * residual[k / r] * residual[k % r]);
    }
    out.iter_mut().for_each(|x| *x /= sum.max(f64::MIN_POSITIVE));
    out
}
