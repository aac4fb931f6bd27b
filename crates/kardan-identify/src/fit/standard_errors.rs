//! Standard errors of a fit.

use kardan_rt::functions::powf;

use super::leverage::Leverage;
use super::robust::influence;
use super::serial::{newey_west, serial_test, series};
use super::solution::Solution;
use super::whitened::Whitened;
use super::{Fit, FitOptions};
use crate::LeastSquares;
use kardan_math::num::Matrix;

/// The problem around a solution, linear in its columns: those free of bounds, then one for each Stribeck speed.
struct Linearised<'a> {
    data: &'a Whitened,
    solution: &'a Solution,
    /// Extra columns with unknown Stribeck speeds.
    searched: Vec<usize>,
}

impl Linearised<'_> {
    fn columns(&self) -> usize {
        self.solution.free.len() + self.searched.len()
    }

    /// Where a value is among the columns: those of the fit, then the Stribeck speeds of the columns that have a shape.
    fn place(&self, value: usize, shaped: &[usize]) -> Option<usize> {
        let (p, free) = (self.data.columns, &self.solution.free);
        if value < p {
            return free.iter().position(|&free| free == value);
        }
        self.searched.iter().position(|&s| s == shaped[value - p]).map(|at| free.len() + at)
    }

    /// A row of a sample; `factors` is work memory.
    fn fill(&self, sample: usize, row: usize, factors: &mut [f64], x: &mut [f64]) {
        let data = self.data;
        let Solution { values, free, .. } = self.solution;
        let w = data.columns - data.extras;
        data.factors(sample, factors);
        let row = data.row(sample, row);
        for (x, &k) in x.iter_mut().zip(free) {
            *x = row[k] * if k >= w { factors[k - w] } else { 1.0 };
        }
        for (x, &k) in x[free.len()..].iter_mut().zip(&self.searched) {
            let (scale, shape) = data.shapes[k].expect("a shape is searched");
            let ratio = data.speeds[sample * data.extras + k] / scale;
            *x = row[w + k] * values[w + k] * shape.slope(ratio) * -ratio / scale;
        }
    }

    fn problem(&self) -> LeastSquares {
        let (data, all) = (self.data, self.columns());
        let mut out = LeastSquares::new(all);
        let (mut x, mut factors, mut residual) = (vec![0.0; all], vec![1.0; data.extras], vec![0.0; data.rows]);
        for sample in 0..data.len() {
            data.residuals(sample, &self.solution.values, &mut residual);
            for i in 0..data.rows {
                self.fill(sample, i, &mut factors, &mut x);
                out.add(&x, residual[i], data.weights[sample].sqrt());
            }
        }
        out
    }

    /// Contribution of each sample to the normal equations, and the degrees of freedom of each column: errors may differ in size
    /// from sample to sample. `bread`: the inverse of the normal matrix.
    fn scores(&self, bread: &Matrix<f64>) -> (Vec<f64>, Vec<f64>) {
        let (data, all, r) = (self.data, self.columns(), self.data.rows);
        let (mut factors, mut residual) = (vec![1.0; data.extras], vec![0.0; r]);
        let mut scores = vec![0.0; data.len() * all];
        let mut block = vec![0.0; r * all];
        let mut leverage = Leverage::new(r, bread);
        for sample in 0..data.len() {
            data.residuals(sample, &self.solution.values, &mut residual);
            let root = data.weights[sample].sqrt();
            for i in 0..r {
                self.fill(sample, i, &mut factors, &mut block[i * all..(i + 1) * all]);
            }
            block.iter_mut().for_each(|x| *x *= root);
            residual.iter_mut().for_each(|x| *x *= root);
            leverage.add(&block, &mut residual);
            let score = &mut scores[sample * all..(sample + 1) * all];
            for (i, residual) in residual.iter().enumerate() {
                score.iter_mut().zip(&block[i * all..(i + 1) * all]).for_each(|(s, x)| *s += x * residual);
            }
        }
        (scores, leverage.degrees_of_freedom())
    }
}

/// The values of a solution with their standard errors, and the degrees of freedom of these.
pub(super) fn with_standard_errors(data: Whitened, solution: &Solution, options: &FitOptions) -> Fit {
    let Whitened { shapes, weights, .. } = &data;
    let (p, w) = (data.columns, data.columns - data.extras);
    let fixed_speed = |k: usize| options.shapes.get(k).copied().flatten().is_some_and(|(_, speed)| speed.is_some());
    let searched: Vec<usize> =
        (0..data.extras).filter(|&k| shapes[k].is_some() && !fixed_speed(k) && solution.values[w + k] != 0.0).collect();
    let linearised = Linearised { data: &data, solution, searched };
    let all = linearised.columns();
    let linear = linearised.problem().solve().unwrap_or_else(|| solution.estimate.clone());
    let effective: f64 =
        weights.iter().map(|weight| f64::from(u8::from(*weight > 0.0))).sum::<f64>() * data.rows as f64;
    let freedom = (effective as usize).saturating_sub(linear.rank) / data.rows.max(1);
    let serial = options.serial.then(|| serial_test(&series(&data, &solution.values))).flatten();
    let lags = match serial {
        Some(probability) if probability < 0.01 => (4.0 * powf(data.len() as f64 / 100.0, 2.0 / 9.0)).ceil() as usize,
        _ => 0,
    };
    let bread = &linear.cofactor;
    let (scores, degrees_of_freedom) = linearised.scores(bread);
    // Influence of each score: their sum of squares has no negative eigenvalue, however collinear the columns are.
    let mut moves = vec![0.0; scores.len()];
    for (own, score) in moves.chunks_exact_mut(all.max(1)).zip(scores.chunks_exact(all.max(1))) {
        own.iter_mut().enumerate().for_each(|(i, x)| *x = (0..all).map(|k| bread[(i, k)] * score[k]).sum());
    }
    let mut covariance = newey_west(&moves, all, lags);
    let influence = influence(options.loss, weights);
    (0..all * all).for_each(|k| covariance[(k / all, k % all)] *= influence);
    // Back to all columns, then the Stribeck speeds.
    let shaped: Vec<usize> = (0..data.extras).filter(|&k| shapes[k].is_some()).collect();
    let total = p + shaped.len();
    let place = |k: usize| linearised.place(k, &shaped);
    let entry = |i: usize, j: usize| match (place(i), place(j)) {
        (Some(i), Some(j)) if i < all && j < all => covariance[(i, j)],
        _ => 0.0,
    };
    let lost = |k: usize| place(k).is_some_and(|at| linear.standard_errors.get(at).is_some_and(|e| e.is_infinite()));
    let error = |k: usize| match place(k) {
        None if k >= p && fixed_speed(shaped[k - p]) => 0.0,
        // The speed of a torque that is zero.
        None if k >= p => f64::INFINITY,
        None => f64::NAN,
        Some(_) if lost(k) => f64::INFINITY,
        Some(_) => entry(k, k).max(0.0).sqrt(),
    };
    let speeds = shapes.iter().flatten().map(|(speed, _)| *speed);
    Fit {
        values: solution.values.iter().copied().chain(speeds).collect(),
        standard_errors: (0..total).map(error).collect(),
        correlation: Matrix::from_fn(total, total, |i, j| {
            let both = (entry(i, i) * entry(j, j)).sqrt();
            if i == j || !(both > 0.0) { f64::from(u8::from(i == j)) } else { entry(i, j) / both }
        }),
        covariance: Matrix::from_fn(total, total, entry),
        undetermined: solution.undetermined(),
        bounded: solution.bounded(),
        condition: solution.estimate.condition,
        scale: f64::NAN,
        degrees_of_freedom: (0..total).map(|k| place(k).map_or(f64::NAN, |at| degrees_of_freedom[at])).collect(),
        freedom,
        lags,
        at_end: Vec::new(),
        row_factors: Vec::new(),
        columns: p,
        weights: data.weights,
        shapes: data.shapes,
    }
}
