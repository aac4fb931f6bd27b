//! Parameters from samples: weighted, robust, bounded; with tests of the residuals.

mod leverage;
mod options;
mod residual_statistics;
mod robust;
mod serial;
mod solution;
mod standard_errors;
mod stribeck_speed;
mod whitened;

pub use options::{FitOptions, Loss, Shape};
pub use residual_statistics::{Test, TestKind, residual_statistics};

use super::Samples;
use super::distribution::{fisher_tail, student_quantile};
use kardan_math::num::{Cholesky, Matrix, dot};
use robust::robust_weights;
use solution::{Solution, row_covariance, scale};
use standard_errors::standard_errors;
use stribeck_speed::search;
use whitened::{Whitened, factor, shape_factor};

/// Parameters: those of the columns, then the Stribeck speeds of extra columns with a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Values.
    pub values: Vec<f64>,
    /// Standard errors: infinite for undetermined values, NaN at a bound, zero for a given Stribeck speed.
    pub standard_errors: Vec<f64>,
    /// Correlations of the errors.
    pub correlation: Matrix<f64>,
    /// Covariance of the values.
    pub covariance: Matrix<f64>,
    /// Combinations of the columns that the samples do not determine.
    pub undetermined: Vec<Vec<f64>>,
    /// Columns whose values are at their bound, zero.
    pub bounded: Vec<usize>,
    /// Largest over smallest singular value, columns scaled to one.
    pub condition: f64,
    /// Residual over what the noise of the sensors explains.
    pub scale: f64,
    /// Samples less the rank for each of their rows.
    pub freedom: usize,
    /// Degrees of freedom of Student's distribution for each value: fewer than `freedom` where few samples determine it. NaN at a bound.
    pub degrees_of_freedom: Vec<f64>,
    /// Factor of each sample under the robust loss.
    pub weights: Vec<f64>,
    /// Lags over which the fit treats errors as correlated; 0: as independent.
    pub lags: usize,
    /// Extra columns whose Stribeck speed lies at an end of the speeds measured.
    pub at_end: Vec<usize>,
    /// Lower triangles by which the rows of a sample were divided, after those of its own covariance.
    row_factors: Vec<Vec<f64>>,
    /// Factors of the extra columns' speeds: Stribeck speed and shape.
    shapes: Vec<Option<(f64, Shape)>>,
    columns: usize,
}

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
    let errors = standard_errors(&data, &solution, options);
    let searched = data.shapes.iter().flatten().map(|(scale, _)| *scale);
    Some(Fit {
        values: solution.values.iter().copied().chain(searched).collect(),
        standard_errors: errors.each,
        correlation: errors.correlation,
        covariance: errors.covariance,
        undetermined: solution.undetermined(),
        bounded: solution.bounded(),
        condition: solution.estimate.condition,
        scale,
        freedom: errors.freedom,
        degrees_of_freedom: errors.degrees_of_freedom,
        weights: data.weights,
        lags: errors.lags,
        at_end,
        row_factors: rows,
        shapes: data.shapes,
        columns: data.columns,
    })
}

impl Fit {
    /// Half the width of the interval that covers a value with a confidence (0.95), by Student's distribution, in standard errors.
    /// NaN where there are no degrees of freedom: then there is no interval.
    pub fn quantile(&self, value: usize, confidence: f64) -> f64 {
        student_quantile(self.degrees_of_freedom[value], confidence)
    }

    /// Probability that values as far from zero as these together, or farther, are found if all of them are zero \[Wald 1943\], by
    /// Fisher's distribution; `None` where one of them is not determined, or is at a bound.
    pub fn joint_tail(&self, values: &[usize]) -> Option<f64> {
        let count = values.len();
        let freedom = values.iter().map(|&k| self.degrees_of_freedom[k]).fold(f64::INFINITY, f64::min);
        let sound = |k: &usize| self.standard_errors[*k].is_finite() && self.standard_errors[*k] > 0.0;
        if count == 0 || !values.iter().all(sound) {
            return None;
        }
        // In standard errors, so that the scales of the values do not matter.
        let block: Vec<f64> =
            values.iter().flat_map(|&i| values.iter().map(move |&j| (i, j))).map(|at| self.correlation[at]).collect();
        let own: Vec<f64> = values.iter().map(|&k| self.values[k] / self.standard_errors[k]).collect();
        let mut factor = Cholesky::new(count);
        if !factor.factor(&block) {
            return None;
        }
        let mut solved = own.clone();
        factor.solve(&mut solved);
        fisher_tail((count as f64, freedom), dot(&own, &solved) / count as f64)
    }

    /// The samples corrected by the errors of the motion that rows without a measured torque yield; none if no correction is needed.
    fn corrected(&self, samples: &Samples) -> Option<Samples> {
        samples.corrected(&self.values, &|sample, row| samples.y(sample)[row] - self.prediction(samples, sample, row))
    }

    /// Prediction of the fit for a row of a sample, N m.
    pub fn prediction(&self, samples: &Samples, sample: usize, row: usize) -> f64 {
        let (p, w) = (self.columns, self.columns - samples.extras);
        let x = &samples.x(sample)[row * p..(row + 1) * p];
        let speeds = samples.speeds(sample);
        let factor = |k: usize| shape_factor(self.shapes[k], speeds[k]);
        dot(&x[..w], &self.values[..w]) + (w..p).map(|k| x[k] * factor(k - w) * self.values[k]).sum::<f64>()
    }
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
