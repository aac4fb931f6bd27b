//! Parameters from samples: weighted, robust, bounded; and what is left over, judged.

use super::distribution::{chi_squared_median_ratio, chi_squared_tail, fisher_tail, student_quantile, student_tails};
use super::{Estimate, LeastSquares, Samples};
use crate::num::{Cholesky, Matrix, dot};

/// How residuals count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// Squares.
    #[default]
    Squares,
    /// Squares, from 1.345 standard deviations on their size alone \[Huber 1964\].
    Huber,
    /// Tukey's bisquare: nothing beyond 4.685 standard deviations; begins where Huber's ends.
    Bisquare,
}

/// What friction is more at low speed, over the speed by the Stribeck speed x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// `exp(−x²)`
    #[default]
    Gaussian,
    /// `exp(−x)`
    Exponential,
    /// `e x exp(−x)`: nothing at rest, most at the Stribeck speed.
    Peak,
}

impl Shape {
    /// The shape at x ≥ 0.
    pub fn value(self, x: f64) -> f64 {
        match self {
            Self::Gaussian => (-x * x).exp(),
            Self::Exponential => (-x).exp(),
            Self::Peak => x * (1.0 - x).exp(),
        }
    }

    /// Its slope.
    pub fn slope(self, x: f64) -> f64 {
        match self {
            Self::Gaussian => -2.0 * x * (-x * x).exp(),
            Self::Exponential => -(-x).exp(),
            Self::Peak => (1.0 - x) * (1.0 - x).exp(),
        }
    }
}

/// How samples are fitted.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FitOptions {
    /// How residuals count.
    pub loss: Loss,
    /// Columns whose values may not be below zero.
    pub nonnegative: Vec<bool>,
    /// Of each extra column the shape over the speed, if it has one; its Stribeck speed is fitted too.
    pub shapes: Vec<Option<Shape>>,
    /// Stribeck speeds that are known, rad/s.
    pub speeds: Vec<Option<f64>>,
    /// Whether the samples follow each other in time so closely that what is left of one tells of the next.
    pub serial: bool,
}

/// Parameters: those of the columns, then the Stribeck speeds of extra columns with a shape.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Values.
    pub values: Vec<f64>,
    /// Standard errors: infinite of what is not determined, NaN at a bound.
    pub standard_errors: Vec<f64>,
    /// Correlations of the errors.
    pub correlation: Matrix<f64>,
    /// Covariance of the values.
    pub covariance: Matrix<f64>,
    /// Combinations of the columns that the samples do not determine.
    pub undetermined: Vec<Vec<f64>>,
    /// Columns whose values stand at their bound, zero.
    pub bounded: Vec<usize>,
    /// Largest over smallest singular value, columns scaled to one.
    pub condition: f64,
    /// Residual over what the noise of the sensors explains.
    pub scale: f64,
    /// Samples less the rank for each of their rows.
    pub freedom: usize,
    /// Degrees of freedom of Student's distribution for each value: fewer than `freedom` where few samples tell it. NaN at a bound.
    pub freedoms: Vec<f64>,
    /// Factor of each sample under the robust loss.
    pub weights: Vec<f64>,
    /// Lags over which errors were taken as correlated; 0: as independent.
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
/// Times that the covariance of the rows is taken anew, and samples for each column that it needs.
const REWEIGHTED: usize = 3;
const FEW: usize = 2;
/// Places in which the Stribeck speed is bracketed, and steps of the golden section after that.
const BRACKETS: usize = 24;
const SECTIONS: usize = 40;

/// Solves `L z = x` in place for the lower triangle L of a covariance, row by row; the identity if it is not definite.
fn factor(covariance: &[f64], rows: usize) -> Vec<f64> {
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

/// `L⁻¹ X` in place, X with so many rows and columns.
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

/// Samples divided by their standard deviations: rows `[X y]` whose errors are independent and of size one.
struct Whitened {
    rows: usize,
    columns: usize,
    extras: usize,
    data: Vec<f64>,
    speeds: Vec<f64>,
}

impl Whitened {
    fn new(samples: &Samples, chosen: &[usize]) -> Self {
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
        Self { rows: r, columns: p, extras: samples.extras, data, speeds }
    }

    /// Divides the rows of every sample by one more lower triangle.
    fn divide(&mut self, lower: &[f64]) {
        let size = self.rows * (self.columns + 1);
        self.data.chunks_exact_mut(size).for_each(|own| forward(lower, self.rows, self.columns + 1, own));
    }

    fn len(&self) -> usize {
        self.data.len() / (self.rows * (self.columns + 1)).max(1)
    }

    fn row(&self, sample: usize, row: usize) -> &[f64] {
        let at = (sample * self.rows + row) * (self.columns + 1);
        &self.data[at..at + self.columns + 1]
    }

    /// Factors of the extra columns of a sample.
    fn factors(&self, sample: usize, shapes: &[Option<(f64, Shape)>], out: &mut [f64]) {
        let speeds = &self.speeds[sample * self.extras..];
        for ((factor, shape), speed) in out.iter_mut().zip(shapes).zip(speeds) {
            *factor = shape.map_or(1.0, |(scale, shape)| shape.value(speed / scale));
        }
    }

    fn problem(&self, shapes: &[Option<(f64, Shape)>], weights: &[f64]) -> LeastSquares {
        let (p, w) = (self.columns, self.columns - self.extras);
        let mut out = LeastSquares::new(p);
        let (mut x, mut factors) = (vec![0.0; p], vec![1.0; self.extras]);
        for sample in 0..self.len() {
            self.factors(sample, shapes, &mut factors);
            for i in 0..self.rows {
                let row = self.row(sample, i);
                x.copy_from_slice(&row[..p]);
                x[w..].iter_mut().zip(&factors).for_each(|(x, factor)| *x *= factor);
                out.add(&x, row[p], weights[sample].sqrt());
            }
        }
        out
    }

    /// Residuals of a sample into `out`.
    fn residuals(&self, sample: usize, values: &[f64], shapes: &[Option<(f64, Shape)>], out: &mut [f64]) {
        let (p, w) = (self.columns, self.columns - self.extras);
        let speeds = &self.speeds[sample * self.extras..];
        let factor = |k: usize| shapes[k].map_or(1.0, |(scale, shape)| shape.value(speeds[k] / scale));
        for (i, left) in out.iter_mut().enumerate() {
            let row = self.row(sample, i);
            let extra: f64 = (w..p).map(|k| row[k] * factor(k - w) * values[k]).sum();
            *left = row[p] - dot(&row[..w], &values[..w]) - extra;
        }
    }
}

/// Fits the samples chosen. `None` if there are none, or a number is not finite.
///
/// Minimises `Σ ρ(‖L⁻¹(y − Xθ)‖)` with `L Lᵀ` the covariance of each sample's rows: QR decompositions of the weighted rows, repeated
/// with the weights of a robust loss; Stribeck speeds by a search in one variable at a time, as all others enter linearly (variable
/// projection). The covariance between rows is then taken from the residuals. Standard errors allow for errors that differ in size from
/// sample to sample, with the degrees of freedom that go with them \[Bell, McCaffrey 2002\]; where samples follow each other and what
/// is left of them is correlated (Ljung, Box), for that too \[Newey, West 1987\].
pub fn fit(samples: &Samples, chosen: &[usize], options: &FitOptions) -> Option<Fit> {
    let mut data = Whitened::new(samples, chosen);
    if data.len() == 0 {
        return None;
    }
    let known = |k: usize| options.speeds.get(k).copied().flatten();
    let mut shapes: Vec<Option<(f64, Shape)>> = (0..samples.extras)
        .map(|k| options.shapes.get(k).copied().flatten().map(|shape| (known(k).unwrap_or(1.0), shape)))
        .collect();
    let mut weights = vec![1.0; data.len()];
    let searched: Vec<usize> = (0..samples.extras).filter(|&k| shapes[k].is_some() && known(k).is_none()).collect();
    let mut at_end = Vec::new();
    for round in 0..if searched.len() > 1 { 3 } else { 1 } {
        at_end.clear();
        for &k in &searched {
            at_end.extend(search(&data, k, &mut shapes, &weights, options, round == 0)?.then_some(k));
        }
    }
    let mut solution = Solution::of(&data, &shapes, &weights, options)?;
    if options.loss != Loss::Squares {
        for round in 0..ROUNDS {
            let next = robust_weights(&data, &solution, &shapes, options.loss, round);
            let change = next.iter().zip(&weights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            weights = next;
            if round == 5 {
                at_end.clear();
                for &k in &searched {
                    at_end.extend(search(&data, k, &mut shapes, &weights, options, false)?.then_some(k));
                }
            }
            solution = Solution::of(&data, &shapes, &weights, options)?;
            if change < 1e-6 && round > 5 {
                break;
            }
        }
    }
    // What is left of the rows need not be as the sensors say: their covariance from the residuals \[Zellner 1962\].
    let scale = scale(&data, &solution, &shapes, &weights);
    let mut rows = Vec::new();
    while data.rows > 1 && rows.len() < REWEIGHTED && data.len() > FEW * data.columns {
        let lower = factor(&row_covariance(&data, &solution, &shapes, &weights), data.rows);
        data.divide(&lower);
        rows.push(lower);
        solution = Solution::of(&data, &shapes, &weights, options)?;
    }
    let mut found = covered(&data, solution, shapes, weights, options, at_end);
    (found.scale, found.row_factors) = (scale, rows);
    Some(found)
}

/// Root mean square of the residuals, for as many rows as are free.
fn scale(data: &Whitened, solution: &Solution, shapes: &[Option<(f64, Shape)>], weights: &[f64]) -> f64 {
    let mut left = vec![0.0; data.rows];
    let (mut square, mut rows) = (0.0, 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, shapes, &mut left);
        square += weights[sample] * dot(&left, &left);
        rows += f64::from(u8::from(weights[sample] > 0.0)) * data.rows as f64;
    }
    let freedom = rows - solution.estimate.rank as f64;
    if freedom > 0.0 { (square / freedom).sqrt() } else { 0.0 }
}

/// Mean of `e eᵀ` over the samples.
fn row_covariance(data: &Whitened, solution: &Solution, shapes: &[Option<(f64, Shape)>], weights: &[f64]) -> Vec<f64> {
    let r = data.rows;
    let (mut left, mut out, mut sum) = (vec![0.0; r], vec![0.0; r * r], 0.0);
    for sample in 0..data.len() {
        data.residuals(sample, &solution.values, shapes, &mut left);
        sum += weights[sample];
        (0..r * r).for_each(|k| out[k] += weights[sample] * left[k / r] * left[k % r]);
    }
    out.iter_mut().for_each(|x| *x /= sum.max(f64::MIN_POSITIVE));
    out
}

/// Values within their bounds.
struct Solution {
    values: Vec<f64>,
    free: Vec<usize>,
    estimate: Estimate,
}

impl Solution {
    fn of(data: &Whitened, shapes: &[Option<(f64, Shape)>], weights: &[f64], options: &FitOptions) -> Option<Self> {
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
}

/// The Stribeck speed of one extra column that leaves least, between the lowest and the highest speed; whether it is at an end.
fn search(
    data: &Whitened,
    extra: usize,
    shapes: &mut [Option<(f64, Shape)>],
    weights: &[f64],
    options: &FitOptions,
    first: bool,
) -> Option<bool> {
    let speeds = data.speeds.iter().skip(extra).step_by(data.extras.max(1)).copied().filter(|v| *v > 0.0);
    let (low, high) = speeds.fold((f64::INFINITY, 0.0_f64), |(low, high), v| (low.min(v), high.max(v)));
    if !(low < high) {
        return Some(true);
    }
    let (low, high) = ((low / 2.0).ln(), high.ln());
    let mut cost = |log: f64| -> Option<f64> {
        if let Some((scale, _)) = &mut shapes[extra] {
            *scale = log.exp();
        }
        Solution::of(data, shapes, weights, options).map(|found| found.estimate.residual)
    };
    let grid = |k: usize| low + (high - low) * k as f64 / (BRACKETS - 1) as f64;
    let mut best = (0, f64::INFINITY);
    for k in 0..BRACKETS {
        let found = cost(grid(k))?;
        if found < best.1 {
            best = (k, found);
        }
    }
    let (mut a, mut b) = (grid(best.0.saturating_sub(1)), grid((best.0 + 1).min(BRACKETS - 1)));
    let ratio = (5.0_f64.sqrt() - 1.0) / 2.0;
    let (mut x, mut y) = (b - ratio * (b - a), a + ratio * (b - a));
    let (mut fx, mut fy) = (cost(x)?, cost(y)?);
    for _ in 0..if first { SECTIONS / 2 } else { SECTIONS } {
        if fx < fy {
            (b, y, fy) = (y, x, fx);
            x = b - ratio * (b - a);
            fx = cost(x)?;
        } else {
            (a, x, fx) = (x, y, fy);
            y = a + ratio * (b - a);
            fy = cost(y)?;
        }
    }
    let middle = (a + b) / 2.0;
    cost(middle)?;
    Some(middle - low < 1e-3 || high - middle < 1e-3)
}

/// Size of the residuals of a sample: the root of their mean square.
fn size(data: &Whitened, sample: usize, values: &[f64], shapes: &[Option<(f64, Shape)>], work: &mut [f64]) -> f64 {
    data.residuals(sample, values, shapes, work);
    (dot(work, work) / data.rows.max(1) as f64).sqrt()
}

fn robust_weights(
    data: &Whitened,
    solution: &Solution,
    shapes: &[Option<(f64, Shape)>],
    loss: Loss,
    round: usize,
) -> Vec<f64> {
    let mut work = vec![0.0; data.rows];
    let sizes: Vec<f64> =
        (0..data.len()).map(|sample| size(data, sample, &solution.values, shapes, &mut work)).collect();
    let mut sorted = sizes.clone();
    sorted.sort_by(f64::total_cmp);
    // The median of the size of so many normal numbers.
    let usual = chi_squared_median_ratio(data.rows as f64).sqrt();
    let scale = sorted[sorted.len() / 2] / usual;
    let weight = |size: f64| {
        let z = if scale > 0.0 { size / scale } else { 0.0 };
        match loss {
            Loss::Squares => 1.0,
            Loss::Bisquare if round >= 5 => {
                if z < 4.685 {
                    (1.0 - (z / 4.685).powi(2)).powi(2)
                } else {
                    0.0
                }
            }
            _ => (1.345 / z).min(1.0),
        }
    };
    sizes.into_iter().map(weight).collect()
}

/// Standard errors of a solution.
fn covered(
    data: &Whitened,
    solution: Solution,
    shapes: Vec<Option<(f64, Shape)>>,
    weights: Vec<f64>,
    options: &FitOptions,
    at_end: Vec<usize>,
) -> Fit {
    let (p, w) = (data.columns, data.columns - data.extras);
    let Solution { values, free, estimate } = solution;
    // Columns of the linearised problem: those free of bounds, then one for each Stribeck speed.
    let known = |k: usize| options.speeds.get(k).copied().flatten().is_some();
    let searched: Vec<usize> =
        (0..data.extras).filter(|&k| shapes[k].is_some() && !known(k) && values[w + k] != 0.0).collect();
    let all = free.len() + searched.len();
    let mut problem = LeastSquares::new(all);
    let (mut x, mut factors, mut left) = (vec![0.0; all], vec![1.0; data.extras], vec![0.0; data.rows]);
    let fill = |sample: usize, i: usize, factors: &mut [f64], x: &mut [f64]| {
        data.factors(sample, &shapes, factors);
        let row = data.row(sample, i);
        for (x, &k) in x.iter_mut().zip(&free) {
            *x = row[k] * if k >= w { factors[k - w] } else { 1.0 };
        }
        for (x, &k) in x[free.len()..].iter_mut().zip(&searched) {
            let (scale, shape) = shapes[k].expect("a shape is searched");
            let ratio = data.speeds[sample * data.extras + k] / scale;
            *x = row[w + k] * values[w + k] * shape.slope(ratio) * -ratio / scale;
        }
    };
    for sample in 0..data.len() {
        data.residuals(sample, &values, &shapes, &mut left);
        for i in 0..data.rows {
            fill(sample, i, &mut factors, &mut x);
            problem.add(&x, left[i], weights[sample].sqrt());
        }
    }
    let linear = problem.solve().unwrap_or_else(|| estimate.clone());
    let rank = linear.rank;
    let effective: f64 =
        weights.iter().map(|weight| f64::from(u8::from(*weight > 0.0))).sum::<f64>() * data.rows as f64;
    let freedom = (effective as usize).saturating_sub(rank) / data.rows.max(1);
    let plain = if freedom > 0 { linear.residual } else { 0.0 };
    let size = all;
    let serial = options.serial.then(|| serial_test(&series(data, &values, &shapes, &weights))).flatten();
    let lags = match serial {
        Some(probability) if probability < 0.01 => (4.0 * (data.len() as f64 / 100.0).powf(2.0 / 9.0)).ceil() as usize,
        _ => 0,
    };
    // Scores of the samples: errors may differ in size from sample to sample.
    let bread = &linear.cofactor;
    let mut scores = vec![0.0; data.len() * all];
    let (r, mut block) = (data.rows, vec![0.0; data.rows * all]);
    let mut leverage = Leverage::new(r, bread);
    for sample in 0..data.len() {
        data.residuals(sample, &values, &shapes, &mut left);
        let root = weights[sample].sqrt();
        for i in 0..r {
            fill(sample, i, &mut factors, &mut block[i * all..(i + 1) * all]);
        }
        block.iter_mut().for_each(|x| *x *= root);
        left.iter_mut().for_each(|x| *x *= root);
        leverage.add(&block, &mut left);
        let score = &mut scores[sample * all..(sample + 1) * all];
        for (i, left) in left.iter().enumerate() {
            score.iter_mut().zip(&block[i * all..(i + 1) * all]).for_each(|(s, x)| *s += x * left);
        }
    }
    let freedoms = leverage.freedoms();
    // What each score moves: their sum of squares has no negative eigenvalue, however badly the columns are told apart.
    let mut moves = vec![0.0; scores.len()];
    for (own, score) in moves.chunks_exact_mut(all.max(1)).zip(scores.chunks_exact(all.max(1))) {
        own.iter_mut().enumerate().for_each(|(i, x)| *x = (0..all).map(|k| bread[(i, k)] * score[k]).sum());
    }
    let mut covariance = newey_west(&moves, all, lags);
    let influence = influence(options.loss, &weights);
    (0..all * all).for_each(|k| covariance[(k / all, k % all)] *= influence);
    // Back to all columns, then the Stribeck speeds.
    let shaped: Vec<usize> = (0..data.extras).filter(|&k| shapes[k].is_some()).collect();
    let total = p + shaped.len();
    let place = |k: usize| -> Option<usize> {
        if k < p {
            return free.iter().position(|&free| free == k);
        }
        searched.iter().position(|&s| s == shaped[k - p]).map(|at| free.len() + at)
    };
    let entry = |i: usize, j: usize| match (place(i), place(j)) {
        (Some(i), Some(j)) if i < size && j < size => covariance[(i, j)],
        _ => 0.0,
    };
    let lost = |k: usize| place(k).is_some_and(|at| linear.standard_errors.get(at).is_some_and(|e| e.is_infinite()));
    let error = |k: usize| match place(k) {
        None => f64::NAN,
        Some(_) if lost(k) => f64::INFINITY,
        Some(_) => entry(k, k).max(0.0).sqrt(),
    };
    let mut out = values;
    out.extend(shaped.iter().map(|&k| shapes[k].map_or(f64::NAN, |(scale, _)| scale)));
    Fit {
        standard_errors: (0..total).map(error).collect(),
        freedoms: (0..total).map(|k| place(k).map_or(f64::NAN, |at| freedoms[at])).collect(),
        correlation: Matrix::from_fn(total, total, |i, j| {
            let both = (entry(i, i) * entry(j, j)).sqrt();
            if i == j || !(both > 0.0) { f64::from(u8::from(i == j)) } else { entry(i, j) / both }
        }),
        covariance: Matrix::from_fn(total, total, entry),
        undetermined: estimate
            .undetermined
            .iter()
            .map(|row| {
                let mut all = vec![0.0; p];
                free.iter().zip(row).for_each(|(&k, x)| all[k] = *x);
                all
            })
            .collect(),
        bounded: (0..p).filter(|k| !free.contains(k)).collect(),
        condition: estimate.condition,
        scale: plain,
        freedom,
        weights,
        lags,
        at_end,
        row_factors: Vec::new(),
        values: out,
        shapes,
        columns: p,
    }
}

impl Fit {
    /// Half the width of the interval that covers a value with a confidence (0.95), by Student's distribution, in standard errors.
    /// NaN where there are no degrees of freedom: then there is no interval.
    pub fn quantile(&self, value: usize, confidence: f64) -> f64 {
        student_quantile(self.freedoms[value], confidence)
    }

    /// What the fit predicts of a row of a sample, N m.
    pub fn prediction(&self, samples: &Samples, sample: usize, row: usize) -> f64 {
        let (p, w) = (self.columns, self.columns - samples.extras);
        let x = &samples.x(sample)[row * p..(row + 1) * p];
        let speeds = samples.speeds(sample);
        let factor = |k: usize| self.shapes[k].map_or(1.0, |(scale, shape)| shape.value(speeds[k] / scale));
        dot(&x[..w], &self.values[..w]) + (w..p).map(|k| x[k] * factor(k - w) * self.values[k]).sum::<f64>()
    }
}

/// Part of the errors below which what a fit leaves of them is rounding.
const ROUNDING: f64 = 1e-9;

/// What samples weigh in a fit: residuals are smaller than errors where a sample has much to say.
///
/// With `B = (XᵀX)⁻¹` the residuals of a sample with rows Xₛ have the covariance `I − XₛBXₛᵀ = LLᵀ` for errors of size one; `L⁻¹e` has
/// the size of the errors. A variance that is summed from these is as sure as one of `(tr K)²/tr K²` samples, where
/// `K = δ_st ‖v_s‖² − u_sᵀBu_t`, `v_s = L⁻ᵀXₛB_j`, `u_s = Xₛᵀv_s` for the value j \[Bell, McCaffrey 2002\].
struct Leverage<'a> {
    bread: &'a Matrix<f64>,
    factor: Cholesky,
    /// XₛB, r × p
    shares: Vec<f64>,
    matrix: Vec<f64>,
    v: Vec<f64>,
    u: Vec<f64>,
    /// For each value: Σ K_ss, Σ K_ss² − (uᵀBu)², and Σ u uᵀ.
    sums: Vec<(f64, f64, Matrix<f64>)>,
    /// For each value: Σ ‖v_s‖², of which Σ K_ss is what the fit has left.
    sizes: Vec<f64>,
    samples: usize,
}

impl<'a> Leverage<'a> {
    fn new(rows: usize, bread: &'a Matrix<f64>) -> Self {
        let p = bread.rows();
        Self {
            bread,
            factor: Cholesky::new(rows),
            shares: vec![0.0; rows * p],
            matrix: vec![0.0; rows * rows],
            v: vec![0.0; rows],
            u: vec![0.0; p],
            sums: vec![(0.0, 0.0, Matrix::zeros(p, p)); p],
            sizes: vec![0.0; p],
            samples: 0,
        }
    }

    /// Takes the rows of a sample; its residuals become of the size of the errors, where the fit does not hang on this sample alone.
    fn add(&mut self, x: &[f64], left: &mut [f64]) {
        let (r, p) = (left.len(), self.bread.rows());
        for i in 0..r {
            for j in 0..p {
                self.shares[i * p + j] = (0..p).map(|k| x[i * p + k] * self.bread[(k, j)]).sum();
            }
        }
        for i in 0..r {
            for j in 0..r {
                let share = dot(&self.shares[i * p..(i + 1) * p], &x[j * p..(j + 1) * p]);
                self.matrix[i * r + j] = f64::from(u8::from(i == j)) - share;
            }
        }
        let spread = (0..r).all(|i| self.matrix[i * r + i] > 1e-6) && self.factor.factor(&self.matrix);
        if spread {
            self.factor.half_solve(left);
        }
        self.samples += 1;
        for (j, (diagonal, square, all)) in self.sums.iter_mut().enumerate() {
            (0..r).for_each(|i| self.v[i] = self.shares[i * p + j]);
            if spread {
                self.factor.other_half_solve(&mut self.v);
            }
            for (k, u) in self.u.iter_mut().enumerate() {
                *u = (0..r).map(|i| x[i * p + k] * self.v[i]).sum();
            }
            let (u, bread) = (&self.u, self.bread);
            let form: f64 = (0..p).map(|k| u[k] * (0..p).map(|l| bread[(k, l)] * u[l]).sum::<f64>()).sum();
            let size = dot(&self.v, &self.v);
            let own = size - form;
            self.sizes[j] += size;
            *diagonal += own;
            *square += own * own - form * form;
            all.add_outer(&1.0, u);
        }
    }

    /// Degrees of freedom of each value; NaN where the fit leaves nothing of the errors but rounding.
    ///
    /// K is symmetric of the order of the samples, so `(tr K)²` is at most their number times `tr K²`: what says more is rounding too.
    fn freedoms(&self) -> Vec<f64> {
        let p = self.bread.rows();
        let of = |((diagonal, square, all), size): (&(f64, f64, Matrix<f64>), &f64)| {
            if !(*diagonal > ROUNDING * size) {
                return f64::NAN;
            }
            let product = Matrix::from_fn(p, p, |i, j| (0..p).map(|k| self.bread[(i, k)] * all[(k, j)]).sum::<f64>());
            let both: f64 = (0..p).map(|i| (0..p).map(|k| product[(i, k)] * product[(k, i)]).sum::<f64>()).sum();
            let least = diagonal * diagonal / self.samples as f64;
            diagonal * diagonal / (square + both).max(least)
        };
        self.sums.iter().zip(&self.sizes).map(of).collect()
    }
}

/// Square of the mean weight of a robust loss over the mean slope of its influence.
fn influence(loss: Loss, weights: &[f64]) -> f64 {
    let slope = |weight: &f64| match loss {
        Loss::Squares => 1.0,
        Loss::Huber => f64::from(u8::from(*weight >= 1.0)),
        Loss::Bisquare => {
            let square = 1.0 - weight.sqrt();
            if *weight > 0.0 { (1.0 - square) * (1.0 - 5.0 * square) } else { 0.0 }
        }
    };
    let (weight, slope) = (weights.iter().sum::<f64>(), weights.iter().map(slope).sum::<f64>());
    if slope > 0.0 && loss != Loss::Squares { (weight / slope).powi(2) } else { 1.0 }
}

/// Long-run covariance sums of scores with Bartlett's weights.
fn newey_west(scores: &[f64], p: usize, lags: usize) -> Matrix<f64> {
    let n = scores.len() / p.max(1);
    let mut out = Matrix::<f64>::zeros(p, p);
    for lag in 0..=lags.min(n.saturating_sub(1)) {
        let weight = 1.0 - lag as f64 / (lags + 1) as f64;
        for t in lag..n {
            let (now, before) = (&scores[t * p..(t + 1) * p], &scores[(t - lag) * p..(t - lag + 1) * p]);
            for i in 0..p {
                for j in 0..p {
                    let both = now[i] * before[j];
                    out[(i, j)] += weight * both;
                    if lag > 0 {
                        out[(j, i)] += weight * both;
                    }
                }
            }
        }
    }
    out
}

/// Residuals of standard size, a series for each row of a sample; those without weight are left out.
fn series(data: &Whitened, values: &[f64], shapes: &[Option<(f64, Shape)>], weights: &[f64]) -> Vec<Vec<f64>> {
    let mut out = vec![Vec::with_capacity(data.len()); data.rows];
    let mut left = vec![0.0; data.rows];
    for sample in (0..data.len()).filter(|&sample| weights[sample] > 0.0) {
        data.residuals(sample, values, shapes, &mut left);
        out.iter_mut().zip(&left).for_each(|(series, x)| series.push(*x));
    }
    out
}

/// Lags of the test for serial correlation.
const TEST_LAGS: usize = 10;

/// Probability under independence that residuals are correlated as they are, or more \[Ljung, Box 1978\].
fn serial_test(series: &[Vec<f64>]) -> Option<f64> {
    let mut sum = 0.0;
    let mut freedom = 0;
    for x in series {
        let n = x.len();
        let lags = TEST_LAGS.min(n / 5);
        let square = dot(x, x);
        if lags == 0 || !(square > 0.0) {
            continue;
        }
        for lag in 1..=lags {
            let r = dot(&x[lag..], &x[..n - lag]) / square;
            sum += n as f64 * (n as f64 + 2.0) * r * r / (n - lag) as f64;
        }
        freedom += lags;
    }
    chi_squared_tail(freedom as f64, sum)
}

/// A test of what is left.
#[derive(Debug, Clone, PartialEq)]
pub struct Test {
    /// What is tested.
    pub what: TestKind,
    /// Probability that it looks as it does, or worse, if all is well.
    pub probability: f64,
}

/// What residuals are tested for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TestKind {
    /// Their mean is zero (row of the balance).
    Mean(usize),
    /// They are independent of each other in time.
    Serial,
    /// They are normal.
    Normal,
    /// They do not depend on the speed of a reduced coordinate.
    Speed(usize),
}

/// Bins of the test for what depends on a speed.
const BINS: usize = 10;

/// Tests of the residuals of a fit on the samples that it was made of.
pub fn residual_tests(samples: &Samples, chosen: &[usize], fit: &Fit) -> Vec<Test> {
    let mut data = Whitened::new(samples, chosen);
    fit.row_factors.iter().for_each(|lower| data.divide(lower));
    let series = series(&data, &fit.values[..fit.columns], &fit.shapes, &fit.weights);
    let mut out = Vec::new();
    let kept: Vec<usize> = (0..data.len()).filter(|&sample| fit.weights[sample] > 0.0).collect();
    let n = kept.len() as f64;
    for (row, x) in series.iter().enumerate() {
        let mean = x.iter().sum::<f64>() / n;
        let spread = (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt();
        let probability = student_tails(n - 1.0, mean / spread).filter(|_| spread > 0.0);
        out.extend(probability.map(|probability| Test { what: TestKind::Mean(row), probability }));
    }
    out.extend(serial_test(&series).map(|probability| Test { what: TestKind::Serial, probability }));
    let all: Vec<f64> = series.concat();
    let count = all.len() as f64;
    let mean = all.iter().sum::<f64>() / count;
    let moment = |power: i32| all.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / count;
    let square = moment(2);
    if square > 0.0 && count > 7.0 {
        let (skew, excess) = (moment(3) / square.powf(1.5), moment(4) / (square * square) - 3.0);
        let sum = count / 6.0 * (skew * skew + excess * excess / 4.0);
        out.extend(chi_squared_tail(2.0, sum).map(|probability| Test { what: TestKind::Normal, probability }));
    }
    for coordinate in 0..samples.freedoms {
        let mut order: Vec<usize> = (0..kept.len()).collect();
        let speed = |k: usize| samples.motion(chosen[kept[k]], 1)[coordinate];
        order.sort_by(|&a, &b| speed(a).total_cmp(&speed(b)));
        let bins = BINS.min(kept.len() / 5);
        if bins < 3 {
            continue;
        }
        let (mut between, mut within) = (0.0, 0.0);
        for x in &series {
            let all = x.iter().sum::<f64>() / n;
            for bin in 0..bins {
                let own = &order[bin * order.len() / bins..(bin + 1) * order.len() / bins];
                let mean = own.iter().map(|&k| x[k]).sum::<f64>() / own.len() as f64;
                between += own.len() as f64 * (mean - all).powi(2);
                within += own.iter().map(|&k| (x[k] - mean).powi(2)).sum::<f64>();
            }
        }
        let rows = series.len() as f64;
        let (a, b) = (rows * (bins as f64 - 1.0), rows * (n - bins as f64));
        let probability = fisher_tail((a, b), between / a / (within / b)).filter(|_| within > 0.0);
        out.extend(probability.map(|probability| Test { what: TestKind::Speed(coordinate), probability }));
    }
    out
}

/// Predictions of each row of each sample chosen by a fit that has not seen its fold; folds by `fold` of each, from 0 on. `None`
/// where a fold leaves nothing to fit.
pub fn cross_validate(samples: &Samples, chosen: &[usize], folds: &[usize], options: &FitOptions) -> Option<Vec<f64>> {
    let count = folds.iter().max().map_or(0, |most| most + 1);
    let mut out = vec![f64::NAN; chosen.len() * samples.rows];
    for fold in 0..count {
        let rest: Vec<usize> =
            chosen.iter().zip(folds).filter(|(_, own)| **own != fold).map(|(sample, _)| *sample).collect();
        let found = fit(samples, &rest, options)?;
        for (k, (&sample, _)) in chosen.iter().zip(folds).enumerate().filter(|(_, (_, own))| **own == fold) {
            for row in 0..samples.rows {
                out[k * samples.rows + row] = found.prediction(samples, sample, row);
            }
        }
    }
    Some(out)
}
