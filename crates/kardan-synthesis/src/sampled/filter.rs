//! The stationary Kalman filter of a sampled system.

use super::hold::integrated;
use crate::regulator::{SampledCost, sampled_lqr};
use kardan_math::num::Matrix;
use kardan_results::Pole;

/// The stationary Kalman filter of a sampled system `x⁺ = Φ x + w`, `y = C x + v`.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Filter {
    /// M of `x̂ ← x̂ + M (y − C x̂)`, states × sensors.
    pub gain: Matrix<f64>,
    /// Eigenvalues of Φ (I − M C), by size.
    pub multipliers: Vec<Pole>,
    /// Relative residual of the Riccati equation.
    pub residual: f64,
}

/// The filter of `ẋ = A x + w` for white noise of these intensities, sampled with a period in s, with sensors whose errors have
/// these variances. `None` if the Riccati equation has no stabilising solution.
pub(crate) fn filter(
    a: &Matrix<f64>,
    c: &Matrix<f64>,
    intensities: &[f64],
    variances: &[f64],
    period: f64,
) -> Option<Filter> {
    let n = a.rows();
    let diagonal =
        |values: &[f64]| Matrix::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 });
    let (transposed, noise) = integrated(&a.transpose(), &diagonal(intensities), period)?;
    let cost = SampledCost { state: noise, input: diagonal(variances), cross: Matrix::zeros(n, c.rows()) };
    let found = sampled_lqr(&transposed, &c.transpose(), &cost)?;
    let p = &found.solution;
    let spread = diagonal(variances).plus(&c.multiply(p).multiply(&c.transpose()));
    let gain = spread.solve(&c.multiply(p))?.transpose();
    Some(Filter { gain, multipliers: found.multipliers, residual: found.residual })
}
