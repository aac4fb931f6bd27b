//! The stationary Kalman filter of a sampled system.

use super::hold::integrated;
use crate::regulator::{SampledCost, SampledRegulator, sampled_lqr};
use kardan_math::num::Matrix;

/// The stationary Kalman filter of `ẋ = A x + w` for white noise of these intensities, sampled with a period in s to `x⁺ = Φ x + w`,
/// with sensors `y = C x + v` whose errors have these variances. `None` if the Riccati equation has no stabilising solution.
///
/// It is the regulator of the dual system: its gain is M of `x̂ ← x̂ + M (y − C x̂)`, states × sensors, its solution the covariance
/// of the prediction's error, its multipliers are the eigenvalues of Φ (I − M C).
pub(crate) fn filter(
    a: &Matrix<f64>,
    c: &Matrix<f64>,
    intensities: &[f64],
    variances: &[f64],
    period: f64,
) -> Option<SampledRegulator> {
    let n = a.rows();
    let diagonal =
        |values: &[f64]| Matrix::from_fn(values.len(), values.len(), |i, j| if i == j { values[i] } else { 0.0 });
    let (transposed, noise) = integrated(&a.transpose(), &diagonal(intensities), period)?;
    let cost = SampledCost { state: noise, input: diagonal(variances), cross: Matrix::zeros(n, c.rows()) };
    let found = sampled_lqr(&transposed, &c.transpose(), &cost)?;
    let p = &found.solution;
    let spread = diagonal(variances).plus(&c.multiply(p).multiply(&c.transpose()));
    let gain = spread.solve(&c.multiply(p))?.transpose();
    Some(SampledRegulator { gain, ..found })
}
