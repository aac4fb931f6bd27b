//! Samples in units of their noise.

use super::Shape;
use crate::{LeastSquares, Samples};
use kardan_math::num::dot;

/// Solves `L z = x` in place for the lower triangle L of a covariance, row by row; the identity if it is not definite.
pub(super) fn factor(covariance: &[f64], rows: usize) -> Vec<f64> {
    let mut out = vec![0.0; rows * rows];
    let largest = (0..rows).map(|i| covariance[i * rows + i]).fold(0.0, f64::max);
    if !(largest > 0.0 && largest.is_finite()) {
        (0..rows).for_each(|i| out[i * rows + i] = 1.0);
        return out;
    }
    for i in 0..rows {
        for j in 0..=i {
            let sum = covariance[i * rows + j] - (0..j).map(|k| out[i * rows + k] * out[j * rows + k]).sum::<f64>();
            // A row without noise of its own counts as if it had a millionth of the largest.
            out[i * rows + j] = if i == j { sum.max(1e-12 * largest).sqrt() } else { sum / out[j * rows + j] };
        }
    }
    out
}

/// `L⁻¹ X` in place, X with this number of rows and columns.
fn forward(lower: &[f64], rows: usize, columns: usize, x: &mut [f64]) {
    for i in 0..rows {
        for j in 0..i {
            let share = lower[i * rows + j];
            for k in 0..columns {
                x[i * columns + k] -= share * x[j * columns + k];
            }
        }
        (0..columns).for_each(|k| x[i * columns + k] /= lower[i * rows + i]);
    }
}

/// Factor of an extra column at a speed: one without a shape over the speed, else that of Stribeck speed and shape.
pub(super) fn shape_factor(shape: Option<(f64, Shape)>, speed: f64) -> f64 {
    shape.map_or(1.0, |(scale, shape)| shape.value(speed / scale))
}

/// Samples divided by their standard deviations: rows `[X y]` whose errors are independent and of size one.
pub(super) struct Whitened {
    pub rows: usize,
    pub columns: usize,
    pub extras: usize,
    data: Vec<f64>,
    /// Speeds of the extra columns, sample by sample.
    pub speeds: Vec<f64>,
    /// Of each extra column its Stribeck speed and shape, if it has them.
    pub shapes: Vec<Option<(f64, Shape)>>,
    /// Factor of each sample under the robust loss.
    pub weights: Vec<f64>,
}

impl Whitened {
    /// The chosen samples, each with the weight one.
    pub fn new(samples: &Samples, chosen: &[usize], shapes: Vec<Option<(f64, Shape)>>) -> Self {
        let (r, p) = (samples.rows, samples.columns);
        let mut data = Vec::with_capacity(chosen.len() * r * (p + 1));
        let mut speeds = Vec::with_capacity(chosen.len() * samples.extras);
        for &sample in chosen {
            let lower = factor(samples.covariance(sample), r);
            let from = data.len();
            for i in 0..r {
                data.extend_from_slice(&samples.x(sample)[i * p..(i + 1) * p]);
                data.push(samples.y(sample)[i]);
            }
            forward(&lower, r, p + 1, &mut data[from..]);
            speeds.extend_from_slice(samples.speeds(sample));
        }
        let weights = vec![1.0; chosen.len()];
        Self { rows: r, columns: p, extras: samples.extras, data, speeds, shapes, weights }
    }

    /// Divides the rows of every sample by one more lower triangle.
    pub fn divide(&mut self, lower: &[f64]) {
        let size = self.rows * (self.columns + 1);
        self.data.chunks_exact_mut(size).for_each(|own| forward(lower, self.rows, self.columns + 1, own));
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.data.len() / (self.rows * (self.columns + 1)).max(1)
    }

    /// A row, followed by its right-hand side.
    pub fn row(&self, sample: usize, row: usize) -> &[f64] {
        let at = (sample * self.rows + row) * (self.columns + 1);
        &self.data[at..at + self.columns + 1]
    }

    /// Factors of the extra columns of a sample.
    pub fn factors(&self, sample: usize, out: &mut [f64]) {
        let speeds = &self.speeds[sample * self.extras..];
        for ((factor, shape), speed) in out.iter_mut().zip(&self.shapes).zip(speeds) {
            *factor = shape_factor(*shape, *speed);
        }
    }

    /// The weighted least squares problem.
    pub fn problem(&self) -> LeastSquares {
        let (p, w) = (self.columns, self.columns - self.extras);
        let mut out = LeastSquares::new(p);
        let (mut x, mut factors) = (vec![0.0; p], vec![1.0; self.extras]);
        for sample in 0..self.len() {
            self.factors(sample, &mut factors);
            for i in 0..self.rows {
                let row = self.row(sample, i);
                x.copy_from_slice(&row[..p]);
                x[w..].iter_mut().zip(&factors).for_each(|(x, factor)| *x *= factor);
                out.add(&x, row[p], self.weights[sample].sqrt());
            }
        }
        out
    }

    /// Residuals of a sample into `out`.
    pub fn residuals(&self, sample: usize, values: &[f64], out: &mut [f64]) {
        let (p, w) = (self.columns, self.columns - self.extras);
        let speeds = &self.speeds[sample * self.extras..];
        let factor = |k: usize| shape_factor(self.shapes[k], speeds[k]);
        for (i, residual) in out.iter_mut().enumerate() {
            let row = self.row(sample, i);
            let extra: f64 = (w..p).map(|k| row[k] * factor(k - w) * values[k]).sum();
            *residual = row[p] - dot(&row[..w], &values[..w]) - extra;
        }
    }
}
