//! The result of a fit.

use kardan_math::num::{Cholesky, Matrix, dot};

use super::Shape;
use super::whitened::shape_factor;
use crate::Samples;
use crate::distribution::{fisher_tail, student_quantile};

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
    pub(super) row_factors: Vec<Vec<f64>>,
    /// Factors of the extra columns' speeds: Stribeck speed and shape.
    pub(super) shapes: Vec<Option<(f64, Shape)>>,
    pub(super) columns: usize,
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
    pub(super) fn corrected(&self, samples: &Samples) -> Option<Samples> {
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
