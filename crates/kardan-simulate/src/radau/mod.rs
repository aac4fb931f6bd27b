//! Integration of stiff loops: Radau IIA (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.8) with 3, 5 or 7 stages, from an
//! exact Jacobian.
//!
//! Stages are the unknowns of a Newton iteration that decouples into one real and some complex systems of the size of
//! the state. The error estimate is that of a polynomial of the degree of the stages, which is the dense output: values
//! within a step are as accurate as the tolerance requires, its end is more accurate.
//!
//! The first step after a start is as short as its fastest motion requires, and its polynomial starts with the slope of
//! the motion there: a direction that breaks away begins to move in the direction of its load.

mod equations;
mod newton;
mod tableau;

use kardan_rt::functions::{exp, ln, powi};

use super::dop853::{Counts, StepError, least_step};
use super::rounding::Rounding;
pub(super) use equations::{Descriptor, Equations};
use kardan_math::num::{StateArchive, max_or_nan};
use newton::Systems;
use tableau::{Tableau, tableau};

/// Safety factor of the step length at which the error equals the tolerance.
const SAFETY: f64 = 0.9;
/// The largest factors by which a step grows or shrinks.
const GROWTH: (f64, f64) = (0.125, 8.0);
/// Steps that would grow by less retain their length, and their factors.
const SAME_STEP: (f64, f64) = (1.0, 1.2);
/// Convergence fast enough for the next step to use the same Jacobian.
const FAST: f64 = 1e-3;
/// End of the iteration, in tolerances.
const CONVERGED: f64 = 1e-2;
/// Changes that stop decreasing and are at most this large, in tolerances, count as rounding.
const ROUNDING: f64 = 0.1;

/// Solver of `ẋ = f(t, x)`, of which the last components are integrals of the others.
pub(super) struct Radau {
    relative: f64,
    absolute: Vec<f64>,
    tableau: &'static Tableau,
    /// States without the integrals.
    implicit: usize,
    pub(super) previous_time: f64,
    pub(super) time: f64,
    pub(super) previous: Vec<f64>,
    pub(super) state: Vec<f64>,
    /// f at the state.
    slope: Vec<f64>,
    /// States at the stages minus that at the begin, in columns of stages; of the last step, and of the trial.
    increments: Vec<f64>,
    trial: Vec<f64>,
    /// The trial in coordinates that decouple the iteration.
    split: Vec<f64>,
    rates: Vec<f64>,
    /// The correction of the last step that makes its polynomial start with the slope, times the length; and that of
    /// the trial.
    correction: Vec<f64>,
    trial_correction: Vec<f64>,
    /// Whether no step was made since the start.
    started: bool,
    /// Whether the Jacobian is that at the state.
    fresh: bool,
    /// Whether there is a Jacobian at all, and whether the increments are those of a step that ends at the state.
    jacobian_valid: bool,
    goes_on: bool,
    /// The length that the factors are for; 0: there are none.
    factored: f64,
    systems: Systems,
    work: Vec<f64>,
    error: Vec<f64>,
    weights: Vec<f64>,
    /// The length of the next step; 0: it is still to be chosen.
    pub(super) next: f64,
    pub(super) counts: Counts,
    /// The rounding errors of steps, as far as they were measured.
    pub(super) rounding: Rounding,
}

impl Radau {
    /// `implicit` states are followed by integrals of theirs.
    pub(super) fn new(relative: f64, absolute: &[f64], implicit: usize) -> Self {
        let (size, tableau) = (absolute.len(), tableau(relative));
        let (zero, stages) = (vec![0.0; size], vec![0.0; size * tableau.stages]);
        Self {
            relative,
            absolute: absolute.to_vec(),
            implicit,
            previous_time: 0.0,
            time: 0.0,
            previous: zero.clone(),
            state: zero.clone(),
            slope: zero.clone(),
            increments: stages.clone(),
            trial: stages.clone(),
            split: stages.clone(),
            rates: stages,
            correction: zero.clone(),
            trial_correction: zero.clone(),
            started: true,
            fresh: false,
            jacobian_valid: false,
            goes_on: false,
            factored: 0.0,
            systems: Systems::new(implicit, tableau),
            work: vec![0.0; 2 * size],
            error: zero,
            weights: vec![0.0; tableau.stages],
            next: 0.0,
            counts: Counts::default(),
            rounding: Rounding::new(size),
            tableau,
        }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        for time in [&mut self.previous_time, &mut self.time, &mut self.next, &mut self.factored] {
            archive.number(time);
        }
        let Self { previous, state, slope, increments, correction, .. } = self;
        [previous, state, slope, increments, correction].into_iter().for_each(|list| archive.numbers(list));
        let Self { started, fresh, jacobian_valid, goes_on, .. } = self;
        [started, fresh, jacobian_valid, goes_on].into_iter().for_each(|flag| archive.flag(flag));
        self.counts.archive_state(archive);
        self.rounding.archive_state(archive);
        if !self.systems.descriptor.archive_state(archive) {
            (self.jacobian_valid, self.factored) = (false, 0.0);
        }
        if self.factored > 0.0 {
            self.factor(self.factored);
        }
    }

    /// Starts at a state, with no history except the counts.
    pub(super) fn start(&mut self, time: f64, state: &[f64], equations: &mut impl Equations) {
        self.state.copy_from_slice(state);
        self.previous.copy_from_slice(state);
        (self.time, self.previous_time) = (time, time);
        equations.rates(time, state, &mut self.slope);
        self.counts.evaluations += 1;
        (self.fresh, self.jacobian_valid, self.goes_on) = (false, false, false);
        (self.factored, self.next, self.started) = (0.0, 0.0, true);
    }

    /// Makes one step, at most to `until`.
    pub(super) fn step(&mut self, until: f64, equations: &mut impl Equations) -> Result<(), StepError> {
        let not_finite = |list: &[f64]| list.iter().any(|x| !x.is_finite());
        if not_finite(&self.state) || not_finite(&self.slope) {
            return Err(StepError::NotFinite { time: self.time });
        }
        let room = until - self.time;
        if self.next == 0.0 {
            self.next = self.starting_step(room, equations);
        }
        if !self.jacobian_valid {
            self.take_jacobian(equations);
        }
        let least = least_step(self.time);
        let mut again = false;
        let mut finite = true;
        loop {
            let whole = 1.01 * self.next >= room;
            let h = if whole { room } else { self.next };
            if h < least {
                return Err(StepError::new(self.time, h, finite));
            }
            if self.factored != h {
                self.factor(h);
            }
            // Without factors there is no solution.
            let convergence = if self.factored == h { self.iterate(h, equations) } else { None };
            finite = self.systems.descriptor.is_finite() && !not_finite(&self.trial);
            let Some((iterations, rate)) = convergence else {
                if !self.fresh {
                    self.take_jacobian(equations);
                } else {
                    self.next = 0.5 * h;
                }
                self.counts.rejected += 1;
                (self.factored, self.goes_on) = (0.0, false);
                continue;
            };
            self.integrate(h);
            let mut error = self.error(h, again, equations);
            let mut growth = self.growth(error, iterations);
            if growth < 1.0 {
                // A shorter step does not help against rounding.
                self.measure_rounding(h, equations);
                error = self.largest_error(1.0);
                growth = self.growth(error, iterations);
            }
            if !(error <= 1.0) {
                self.next = if error.is_nan() { 0.5 * h } else { h * growth.min(0.9) };
                self.counts.rejected += 1;
                (again, self.goes_on) = (true, false);
                if !self.fresh {
                    self.take_jacobian(equations);
                }
                continue;
            }
            self.accept(if whole { until } else { self.time + h }, equations);
            let reused = rate < FAST;
            if !reused {
                self.take_jacobian(equations);
            }
            let same_step = SAME_STEP.0 <= growth && growth <= SAME_STEP.1;
            // A shortened step shows only that a longer one may be possible.
            let proposed = if same_step { h } else { h * growth };
            self.next = if whole { self.next.max(proposed) } else { proposed };
            return Ok(());
        }
    }

    /// The factor by which the next step may be longer than one with this error.
    fn growth(&self, error: f64, iterations: usize) -> f64 {
        // Fewer iterations than the maximum allow a larger factor.
        let most = self.most_iterations() as f64;
        let effort = (2.0 * most + 1.0) / (2.0 * most + iterations as f64);
        let power = -1.0 / (self.tableau.stages as f64 + 1.0);
        let growth = if error > 0.0 { SAFETY * effort * exp(power * ln(error)) } else { GROWTH.1 };
        growth.clamp(GROWTH.0, GROWTH.1)
    }

    fn accept(&mut self, end: f64, equations: &mut impl Equations) {
        (self.previous_time, self.time) = (self.time, end);
        std::mem::swap(&mut self.increments, &mut self.trial);
        match self.started {
            true => std::mem::swap(&mut self.correction, &mut self.trial_correction),
            false => self.correction.fill(0.0),
        }
        let last = self.tableau.stages - 1;
        self.previous.copy_from_slice(&self.state);
        let ends = self.increments.iter().skip(last).step_by(self.tableau.stages);
        self.state.iter_mut().zip(ends).for_each(|(x, z)| *x += z);
        equations.rates(self.time, &self.state, &mut self.slope);
        self.counts.evaluations += 1;
        self.counts.accepted += 1;
        (self.started, self.fresh, self.goes_on) = (false, false, true);
    }

    fn take_jacobian(&mut self, equations: &mut impl Equations) {
        let Self { systems, time, state, slope, absolute, relative, .. } = self;
        let sizes = absolute.iter().zip(&*state).map(|(absolute, x)| x.abs().max(absolute / *relative));
        let evaluations = systems.linearise((*time, state, slope), sizes, equations);
        self.counts.evaluations += evaluations;
        (self.fresh, self.jacobian_valid, self.factored) = (true, true, 0.0);
    }

    fn factor(&mut self, h: f64) {
        // A singular matrix, or one with NaN, makes the step fail.
        self.factored = if self.systems.factor(h, self.tableau) { h } else { f64::NAN };
    }

    /// Largest number of iterations.
    fn most_iterations(&self) -> usize {
        7 + 3 * (self.tableau.stages - 3) / 2
    }

    /// Solves for the increments of the trial; `None` if that does not converge. Returns the number of iterations, and
    /// by how much each one reduces the defect.
    fn iterate(&mut self, h: f64, equations: &mut impl Equations) -> Option<(usize, f64)> {
        self.predict(h);
        let (mut before, mut rate) = (f64::NAN, 0.0f64);
        for iteration in 1..=self.most_iterations() {
            self.evaluate(h, equations);
            let change = self.improve(h);
            if !change.is_finite() {
                return None;
            }
            if iteration > 1 {
                let now = change / before;
                rate = if iteration == 2 { now } else { (now * rate).sqrt() };
                let remaining = (self.most_iterations() - iteration) as i32;
                if rate >= 0.99 || rate / (1.0 - rate) * change * powi(rate, remaining) > 1.0 {
                    // At the level of rounding no iteration improves the result.
                    return (change <= ROUNDING).then_some((iteration, rate));
                }
            }
            // The estimated change by the remaining iterations.
            let rest = if iteration == 1 { change } else { rate / (1.0 - rate) * change };
            if change == 0.0 || rest <= CONVERGED && iteration > 1 || change <= CONVERGED * FAST {
                return Some((iteration, rate));
            }
            before = change;
        }
        None
    }

    /// First values of the increments: the extrapolation of the last step's polynomial.
    fn predict(&mut self, h: f64) {
        let Self { tableau, increments, trial, split, weights, .. } = self;
        let s = tableau.stages;
        if self.goes_on {
            let last = self.time - self.previous_time;
            for i in 0..s {
                tableau.weights(1.0 + tableau.nodes[i] * h / last, weights);
                for (trial, increments) in trial.chunks_exact_mut(s).zip(increments.chunks_exact(s)) {
                    let extrapolated: f64 = increments.iter().zip(&*weights).map(|(z, w)| z * w).sum();
                    trial[i] = extrapolated - increments[s - 1];
                }
            }
        } else {
            trial.fill(0.0);
        }
        for (split, trial) in split.chunks_exact_mut(s).zip(trial.chunks_exact(s)) {
            for (out, row) in split.iter_mut().zip(tableau.inverse.chunks_exact(s)) {
                *out = row.iter().zip(trial).map(|(m, z)| m * z).sum();
            }
        }
    }

    /// The rates at the stages of the trial.
    fn evaluate(&mut self, h: f64, equations: &mut impl Equations) {
        let Self { tableau, state, trial, rates, work, .. } = self;
        let (s, size) = (tableau.stages, state.len());
        let (trial_state, slope) = work.split_at_mut(size);
        for i in 0..s {
            for ((trial_state, x), trial) in trial_state.iter_mut().zip(&*state).zip(trial.chunks_exact(s)) {
                *trial_state = x + trial[i];
            }
            equations.rates(self.time + tableau.nodes[i] * h, trial_state, slope);
            rates.chunks_exact_mut(s).zip(&*slope).for_each(|(rates, slope)| rates[i] = *slope);
        }
        self.counts.evaluations += s as u64;
    }

    /// One iteration; gives the largest change, in tolerances.
    fn improve(&mut self, h: f64) -> f64 {
        let Self { tableau, implicit: n, split, trial, rates, work, state, .. } = self;
        let (s, n) = (tableau.stages, *n);
        // The residual, in the coordinates of the iteration: T⁻¹ f − Λ w/h, in place of the rates.
        for (rates, w) in rates.chunks_exact_mut(s).zip(split.chunks_exact(s)).take(n) {
            for (out, row) in work.iter_mut().zip(tableau.inverse.chunks_exact(s)) {
                *out = row.iter().zip(&*rates).map(|(m, f)| m * f).sum();
            }
            rates[0] = work[0] - tableau.real / h * w[0];
            for (k, (alpha, beta)) in tableau.pairs.iter().enumerate() {
                let (i, j) = (2 * k + 1, 2 * k + 2);
                rates[i] = work[i] - (alpha * w[i] + beta * w[j]) / h;
                rates[j] = work[j] - (alpha * w[j] - beta * w[i]) / h;
            }
        }
        work.iter_mut().zip(rates.chunks_exact(s)).take(n).for_each(|(out, rates)| *out = rates[0]);
        self.systems.solve(&mut work[..n]);
        split.chunks_exact_mut(s).zip(&*work).take(n).for_each(|(split, change)| split[0] += change);
        for k in 0..tableau.pairs.len() {
            let (i, j) = (2 * k + 1, 2 * k + 2);
            for (row, rates) in rates.chunks_exact(s).enumerate().take(n) {
                (work[row], work[n + row]) = (rates[i], rates[j]);
            }
            self.systems.solve_pair(k, &mut work[..2 * n]);
            for (row, split) in split.chunks_exact_mut(s).enumerate().take(n) {
                split[i] += work[row];
                split[j] += work[n + row];
            }
        }
        let mut largest = 0.0f64;
        for (k, (trial, split)) in trial.chunks_exact_mut(s).zip(split.chunks_exact(s)).take(n).enumerate() {
            let size = self.absolute[k] + self.relative * state[k].abs();
            for (z, row) in trial.iter_mut().zip(tableau.vectors.chunks_exact(s)) {
                let next: f64 = row.iter().zip(split).map(|(m, w)| m * w).sum();
                let change = (next - *z).abs() / size;
                *z = next;
                largest = max_or_nan(largest, change);
            }
        }
        largest
    }

    /// The increments of the integrals, from the last rates.
    fn integrate(&mut self, h: f64) {
        let Self { tableau, implicit, trial, rates, .. } = self;
        let s = tableau.stages;
        for (trial, rates) in trial.chunks_exact_mut(s).zip(rates.chunks_exact(s)).skip(*implicit) {
            for (z, row) in trial.iter_mut().zip(tableau.integrals.chunks_exact(s)) {
                *z = h * row.iter().zip(rates).map(|(a, f)| a * f).sum::<f64>();
            }
        }
    }

    /// The error of the trial, in tolerances. After a rejection with one more evaluation, as the estimate of a stiff
    /// component is otherwise too large.
    fn error(&mut self, h: f64, again: bool, equations: &mut impl Equations) -> f64 {
        let found = self.estimate(h, None);
        if self.started || !(again && found > 1.0) {
            return found;
        }
        let mut work = std::mem::take(&mut self.work);
        let (trial_state, slope) = work.split_at_mut(self.state.len());
        for (k, trial) in trial_state.iter_mut().enumerate() {
            *trial = self.state[k] + self.error[k];
        }
        equations.rates(self.time, trial_state, slope);
        self.counts.evaluations += 1;
        let found = self.estimate(h, Some(slope));
        self.work = work;
        found
    }

    /// `((γ/h) I − J)⁻¹ (f + (γ/h) Σ e_i z_i)`, with f at the begin or that given; in the first step without J.
    fn estimate(&mut self, h: f64, slope: Option<&[f64]>) -> f64 {
        let Self { tableau, implicit, trial, trial_correction, error, .. } = self;
        let (s, per) = (tableau.stages, tableau.real / h);
        let slope = slope.unwrap_or(&self.slope);
        for ((error, trial), slope) in error.iter_mut().zip(trial.chunks_exact(s)).zip(slope) {
            let sum: f64 = trial.iter().zip(&tableau.error).map(|(z, e)| z * e).sum();
            *error = slope + per * sum;
        }
        let unfiltered = if self.started {
            // The slope less that of the polynomial.
            trial_correction.iter_mut().zip(&*error).for_each(|(correction, error)| *correction = h * error);
            0
        } else {
            self.systems.solve(&mut error[..*implicit]);
            *implicit
        };
        error[unfiltered..].iter_mut().for_each(|error| *error /= per);
        self.largest_error(0.0)
    }

    /// The largest error in tolerances, with a multiple of the last measured rounding error of the estimate added.
    fn largest_error(&self, rounding: f64) -> f64 {
        let Self { tableau, error, trial, state, absolute, relative, rounding: Rounding { noise, .. }, .. } = self;
        let ends = trial.iter().skip(tableau.stages - 1).step_by(tableau.stages);
        error.iter().zip(ends).enumerate().fold(0.0, |largest, (k, (error, end))| {
            let size = state[k].abs().max((state[k] + end).abs());
            max_or_nan(largest, error.abs() / (absolute[k] + relative * size + rounding * noise[k]))
        })
    }

    /// The rounding error of the error estimate, through the same system; for the integrals also through that of the
    /// state.
    fn measure_rounding(&mut self, h: f64, equations: &mut impl Equations) {
        let Self { tableau, implicit, time, state, slope, systems, work, rounding, counts, absolute, relative, .. } =
            self;
        let (n, per, time) = (*implicit, tableau.real / h, *time);
        let moved = &mut work[..state.len()];
        counts.evaluations += 2 * rounding.measure(state, |perturbed, change| {
            equations.rates(time, perturbed, change);
            change.iter_mut().zip(&*slope).for_each(|(change, slope)| *change -= slope);
            systems.solve(&mut change[..n]);
            for k in 0..n {
                perturbed[k] = state[k] + change[k];
            }
            equations.rates(time, perturbed, moved);
            for k in n..change.len() {
                change[k] = (change[k].abs() + (moved[k] - slope[k]).abs()) / per;
            }
        });
        // The estimate differentiates the states at the stages, of which each is rounded too.
        rounding.noise.iter_mut().zip(&*state).for_each(|(noise, x)| *noise += 0.5 * f64::EPSILON * x.abs());
        let sizes = absolute.iter().zip(&*state).map(|(absolute, x)| absolute + *relative * x.abs());
        rounding.in_step(tableau.amplification, sizes);
    }

    /// A first length, from slope and its change, as that of DOP853 is found \[HNW, II.4\].
    fn starting_step(&mut self, room: f64, equations: &mut impl Equations) -> f64 {
        let Self { state, slope, absolute, relative, work, .. } = self;
        let norm = |value: &dyn Fn(usize) -> f64| {
            (0..state.len()).map(|i| value(i).abs() / (absolute[i] + *relative * state[i].abs())).fold(0.0, f64::max)
        };
        let (size, speed) = (norm(&|i| state[i]), norm(&|i| slope[i]));
        let euler = if size >= 1e-5 && speed >= 1e-5 { 0.01 * size / speed } else { 1e-6 }.min(room);
        let (trial_state, trial_slope) = work.split_at_mut(state.len());
        for (k, trial) in trial_state.iter_mut().enumerate() {
            *trial = state[k] + euler * slope[k];
        }
        equations.rates(self.time + euler, trial_state, trial_slope);
        self.counts.evaluations += 1;
        let curvature = norm(&|i| trial_slope[i] - slope[i]) / euler;
        if !curvature.is_finite() || !speed.is_finite() {
            return euler;
        }
        let most = speed.max(curvature);
        let power = 1.0 / (self.tableau.stages as f64 + 1.0);
        let second = if most <= 1e-15 { (1e-3 * euler).max(1e-6) } else { exp(power * ln(0.01 / most)) };
        second.min(100.0 * euler).min(room)
    }

    /// Whether all rates are exactly zero at the current state.
    pub(super) fn rests(&self) -> bool {
        self.slope.iter().all(|slope| *slope == 0.0)
    }

    /// Keeps the state constant until a time.
    pub(super) fn rest(&mut self, until: f64) {
        self.previous.copy_from_slice(&self.state);
        (self.previous_time, self.time) = (self.time, until);
        self.increments.fill(0.0);
        self.correction.fill(0.0);
        (self.fresh, self.jacobian_valid, self.goes_on) = (false, false, false);
        self.counts.accepted += 1;
    }

    /// The state within the last step.
    pub(super) fn interpolate(&self, time: f64, out: &mut [f64]) {
        let (s, length) = (self.tableau.stages, self.time - self.previous_time);
        if length == 0.0 {
            out.copy_from_slice(&self.state);
            return;
        }
        let mut weights = [0.0; 7];
        let weights = &mut weights[..s];
        let correction = self.tableau.weights((time - self.previous_time) / length, weights);
        let terms = self.previous.iter().zip(self.increments.chunks_exact(s)).zip(&self.correction);
        for (out, ((x, z), own)) in out.iter_mut().zip(terms) {
            *out = x + z.iter().zip(&*weights).fold(correction * own, |sum, (z, w)| sum + z * w);
        }
    }
}
