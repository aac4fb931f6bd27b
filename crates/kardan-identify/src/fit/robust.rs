//! Weights of samples under a robust loss.

use kardan_rt::functions::powi;

use super::Loss;
use super::solution::Solution;
use super::whitened::Whitened;
use crate::distribution::chi_squared_median_ratio;
use kardan_math::num::dot;

/// The weight of each sample, by the size of its residuals: the root of their mean square.
pub(super) fn robust_weights(data: &Whitened, solution: &Solution, loss: Loss, round: usize) -> Vec<f64> {
    let mut residual = vec![0.0; data.rows];
    let mut size = |sample: usize| {
        data.residuals(sample, &solution.values, &mut residual);
        (dot(&residual, &residual) / data.rows.max(1) as f64).sqrt()
    };
    let sizes: Vec<f64> = (0..data.len()).map(&mut size).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    // The median of the root mean square of this number of normal variables.
    let usual = chi_squared_median_ratio(data.rows as f64).sqrt();
    let scale = sorted[sorted.len() / 2] / usual;
    let weight = |size: f64| {
        let z = if scale > 0.0 { size / scale } else { 0.0 };
        match loss {
            Loss::Squares => 1.0,
            Loss::Bisquare if round >= 5 && z < 4.685 => powi(1.0 - powi(z / 4.685, 2), 2),
            Loss::Bisquare if round >= 5 => 0.0,
            _ => (1.345 / z).min(1.0),
        }
    };
    sizes.into_iter().map(weight).collect()
}

/// Square of the mean weight of a robust loss over the mean slope of its influence.
pub(super) fn influence(loss: Loss, weights: &[f64]) -> f64 {
    let slope = |weight: &f64| match loss {
        Loss::Squares => 1.0,
        Loss::Huber => f64::from(u8::from(*weight >= 1.0)),
        Loss::Bisquare => {
            let square = 1.0 - weight.sqrt();
            if *weight > 0.0 { (1.0 - square) * (1.0 - 5.0 * square) } else { 0.0 }
        }
    };
    let (weight, slope) = (weights.iter().sum::<f64>(), weights.iter().map(slope).sum::<f64>());
    if slope > 0.0 && loss != Loss::Squares { powi(weight / slope, 2) } else { 1.0 }
}
