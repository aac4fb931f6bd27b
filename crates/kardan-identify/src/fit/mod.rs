//! Parameters from samples: weighted, robust, bounded; with tests of the residuals.

mod found;
mod leverage;
mod options;
mod residual_statistics;
mod robust;
mod serial;
mod solution;
mod standard_errors;
mod stribeck_speed;
mod whitened;

pub use found::Fit;
pub use options::{FitOptions, Loss, Shape};
pub use residual_statistics::{Test, TestKind, residual_statistics};

use super::Samples;
use robust::robust_weights;
use solution::{Solution, row_covariance, scale};
use standard_errors::with_standard_errors;
use stribeck_speed::search;
use whitened::{Whitened, factor};

/// Rounds of reweighting.
const ROUNDS: usize = 50;
/// Rounds of correction of the errors of the motion, and the change in standard errors that ends them.
const CORRECTIONS: usize = 20;
const SETTLED: f64 = 1e-3;
/// Number of re-estimations of the covariance of the rows, and samples for each column that it needs.
const REWEIGHTED: usize = 3;
const ROWS_PER_COLUMN: usize = 2;

/// Fits the samples chosen. `None` if there are none, or a number is not finite.
///
/// Minimises `Σ ρ(‖L⁻¹(y − Xθ)‖)` with `L Lᵀ` the covariance of each sample's rows: QR decompositions of the weighted rows, repeated
/// with the weights of a robust loss; Stribeck speeds by a search in one variable at a time, as all others enter linearly (variable
/// projection). The covariance between rows is then taken from the residuals. Standard errors allow for errors that differ in size from
/// sample to sample, with the degrees of freedom that go with them \[Bell, McCaffrey 2002\]; where samples are consecutive and their
/// residuals are correlated (Ljung, Box), for that too \[Newey, West 1987\].
///
/// Rows without a measured torque cannot determine the magnitude of their coefficients: see [`Samples`] with errors, whose motion is
/// corrected at each solution until convergence.
pub fn fit(samples: &Samples, chosen: &[usize], options: &FitOptions) -> Option<Fit> {
    if samples.errors.is_none() {
        return linear(samples, chosen, options, REWEIGHTED);
    }
    // Weights that depend on the unknowns come last.
    let mut found = linear(samples, chosen, options, 0)?;
    for _ in 0..CORRECTIONS {
        let Some(corrected) = found.corrected(samples) else { break };
        let next = linear(&corrected, chosen, options, REWEIGHTED)?;
        let moved = |k: usize| (next.values[k] - found.values[k]).abs() > SETTLED * next.standard_errors[k].abs();
        let settled = !(0..next.values.len()).any(moved);
        found = next;
        if settled {
            break;
        }
    }
    Some(found)
}

/// Fits rows as they are.
fn linear(samples: &Samples, chosen: &[usize], options: &FitOptions, reweighted: usize) -> Option<Fit> {
    let shape_of = |k: usize| options.shapes.get(k).copied().flatten();
    let starting = |k: usize| shape_of(k).map(|(shape, speed)| (speed.unwrap_or(1.0), shape));
    let shapes = (0..samples.extras).map(starting).collect();
    let mut data = Whitened::new(samples, chosen, shapes);
    if data.len() == 0 {
        return None;
    }
    let searched: Vec<usize> =
        (0..samples.extras).filter(|&k| shape_of(k).is_some_and(|(_, speed)| speed.is_none())).collect();
    let mut at_end = Vec::new();
    for round in 0..if searched.len() > 1 { 3 } else { 1 } {
        at_end.clear();
        for &k in &searched {
            at_end.extend(search(&mut data, k, options, round == 0)?.then_some(k));
        }
    }
    let mut solution = Solution::of(&data, options)?;
    if options.loss != Loss::Squares {
        for round in 0..ROUNDS {
            let next = robust_weights(&data, &solution, options.loss, round);
            let change = next.iter().zip(&data.weights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            data.weights = next;
            if round == 5 {
                at_end.clear();
                for &k in &searched {
                    at_end.extend(search(&mut data, k, options, false)?.then_some(k));
                }
            }
            solution = Solution::of(&data, options)?;
            if change < 1e-6 && round > 5 {
                break;
            }
        }
    }
    // Residuals of the rows need not match the sensor noise: their covariance comes from the residuals \[Zellner 1962\].
    let scale = scale(&data, &solution);
    let mut rows = Vec::new();
    while data.rows > 1 && rows.len() < reweighted && data.len() > ROWS_PER_COLUMN * data.columns {
        let lower = factor(&row_covariance(&data, &solution), data.rows);
        data.divide(&lower);
        rows.push(lower);
        solution = Solution::of(&data, options)?;
    }
    let found = with_standard_errors(data, &solution, options);
    Some(Fit { scale, at_end, row_factors: rows, ..found })
}

/// Predictions of each row of each sample by a fit without its fold; the folds of the samples are numbered from 0 on. `None` if a
/// fold leaves no samples to fit.
pub fn cross_validate(samples: &Samples, folds: &[usize], options: &FitOptions) -> Option<Vec<f64>> {
    let count = folds.iter().max().map_or(0, |most| most + 1);
    let mut out = vec![f64::NAN; samples.len() * samples.rows];
    for fold in 0..count {
        let (own, rest): (Vec<usize>, Vec<usize>) = (0..samples.len()).partition(|&sample| folds[sample] == fold);
        let found = fit(samples, &rest, options)?;
        for sample in own {
            for row in 0..samples.rows {
                out[sample * samples.rows + row] = found.prediction(samples, sample, row);
            }
        }
    }
    Some(out)
}
