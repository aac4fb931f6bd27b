//! Integration by Taylor series: every step is the series of the motion at its begin, as long as its last terms are
//! within the tolerance.
//!
//! The order follows from the tolerance, the length of a step from the last two terms (Jorba and Zou, Experimental Mathematics 14, 2005,
//! 99). Where the step is short anyway, as between two samples of a controller, fewer terms suffice. The series is the dense output.
//!
//! Terms may vanish without being the last ones: `ẍ = −cos x` from rest has those of orders 2, 6, 10 only. Where the
//! last two are suddenly small, the rates at the end of the step show whether the series still follows the motion, and
//! the step is shortened until it does. The same check with a wider tolerance applies inside every step and at its end:
//! a motion that begins as flat as a high power shows in none of the terms.

use kardan_rt::functions::{exp, ln};

use super::dop853::{Counts, StepError, least_step};
use super::rounding::Rounding;
use kardan_math::num::StateArchive;

/// Part of the length at which the last terms are as large as the tolerance.
const SAFETY: f64 = 0.9;
/// Two successive terms this small, in tolerances, are the last ones of a step whose length is known.
const SMALL_TERM: f64 = 1e-2;
/// The last two terms are suddenly small below this part of their extrapolation from the two before them.
const SUDDENLY: f64 = 1e-2;
/// Where all terms were requested the last two are not that small, in tolerances.
const TOO_SMALL: f64 = 1e-4;
/// Number of earlier terms that are checked, and their largest excess over the even decay from the whole to a
/// tolerance.
const BEFORE: usize = 4;
const ABOVE: f64 = 30.0;
/// The largest ratio of the last two terms to the two before them.
const FALL: f64 = 0.5;
/// The allowed difference of slopes inside a step from the rates where its terms are conclusive, in tolerances over its
/// length; and the checked places, in parts of the step.
pub(super) const SLOPE_DEFECT: f64 = 30.0;
pub(super) const INSIDE: [f64; 2] = [0.618_034, 1.0];
/// In half of a step an error of the series shrinks below this part; a rounding error does not.
const ROUNDING: f64 = 0.25;
/// Part of the state that bounds rounding; above, an error of the series may decrease slowly too.
const SLIGHT: f64 = 1e-2;
/// Steps between two measurements of the rounding error of a step.
const CHECK_ROUNDING: u64 = 64;
/// Components whose series are summed at once.
const LANES: usize = 4;
/// The lowest and the highest order.
const ORDERS: std::ops::RangeInclusive<usize> = 4..=24;

/// Solver of `ẋ = f(t, x)` by Taylor series.
#[derive(Debug, Clone)]
pub(super) struct Taylor {
    relative: f64,
    absolute: Vec<f64>,
    /// The highest order that the memory allows.
    most: usize,
    pub(super) previous_time: f64,
    pub(super) time: f64,
    pub(super) previous: Vec<f64>,
    pub(super) state: Vec<f64>,
    /// Coefficients at the begin of the last step, those of an order one after the other.
    pub(super) coefficients: Vec<f64>,
    /// The highest order used in the last step.
    pub(super) order: usize,
    /// Whether all terms are computed where the states need fewer: other values are checked too.
    all_terms: bool,
    /// Evaluations of the machine when the first coefficients at the state were computed: while there are no more, they
    /// and its factors are valid.
    begun: Option<u64>,
    /// The length that the next step is expected to have.
    pub(super) next: f64,
    /// Whether the end of the last step must be checked.
    doubtful: bool,
    /// Memory for rates and for a state inside.
    rates: Vec<f64>,
    inside: Vec<f64>,
    slopes: Vec<f64>,
    pub(super) counts: Counts,
    /// The rounding errors of steps, as far as they were measured.
    pub(super) rounding: Rounding,
}

/// The order for a relative tolerance; some orders more or less have little effect on the time of a run.
pub(super) fn order(relative: f64) -> usize {
    let order = (-0.5 * ln(relative.max(1e-20)) + 2.0).ceil() as usize;
    order.clamp(*ORDERS.start(), *ORDERS.end())
}

/// Whether the larger one of two terms is far below the extrapolation from two earlier ones.
fn is_sudden([first, second]: [f64; 2], last: f64) -> bool {
    let falls = if second < first { second / first } else { 1.0 };
    last < SUDDENLY * second * falls
}

/// Writes the first of some values, as many as there are places.
fn put(out: &mut [f64], values: [f64; LANES]) {
    match out.first_chunk_mut() {
        Some(whole) => *whole = values,
        None => out.iter_mut().zip(values).for_each(|(out, value)| *out = value),
    }
}

impl Taylor {
    pub(super) fn new(relative: f64, absolute: &[f64], all_terms: bool) -> Self {
        let (zero, most) = (vec![0.0; absolute.len()], order(relative));
        Self {
            relative,
            absolute: absolute.to_vec(),
            most,
            previous_time: 0.0,
            time: 0.0,
            previous: zero.clone(),
            coefficients: vec![0.0; zero.len() * (most + 1) + LANES],
            state: zero,
            order: 0,
            all_terms,
            begun: None,
            next: 0.0,
            doubtful: false,
            rates: vec![0.0; absolute.len()],
            inside: vec![0.0; absolute.len()],
            slopes: vec![0.0; absolute.len()],
            counts: Counts::default(),
            rounding: Rounding::new(absolute.len()),
        }
    }

    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        for time in [&mut self.previous_time, &mut self.time, &mut self.next] {
            archive.number(time);
        }
        for list in [&mut self.previous, &mut self.state, &mut self.coefficients] {
            archive.numbers(list);
        }
        archive.count(&mut self.order);
        self.begun = None;
        self.order = self.order.min(self.most);
        self.counts.archive_state(archive);
        self.rounding.archive_state(archive);
    }

    /// Starts at a state. `expand(k, x)` writes the coefficients of order k + 1 from those up to k and returns how much
    /// the machine has evaluated until then.
    pub(super) fn start(&mut self, time: f64, state: &[f64], expand: impl FnMut(usize, &mut [f64]) -> u64) {
        self.state.copy_from_slice(state);
        self.previous.copy_from_slice(state);
        (self.time, self.previous_time) = (time, time);
        self.begin(expand);
    }

    fn begin(&mut self, mut expand: impl FnMut(usize, &mut [f64]) -> u64) {
        self.coefficients[..self.state.len()].copy_from_slice(&self.state);
        self.begun = Some(expand(0, &mut self.coefficients));
        self.counts.evaluations += 1;
        self.order = 1;
    }

    /// Makes one step, at most to `until`; `evaluated` is how much the machine has evaluated so far.
    pub(super) fn step(
        &mut self,
        until: f64,
        evaluated: u64,
        mut expand: impl FnMut(usize, &mut [f64]) -> u64,
    ) -> Result<(), StepError> {
        let room = until - self.time;
        if self.begun != Some(evaluated) {
            self.begin(&mut expand);
        }
        self.begun = None;
        // Fewer terms than all suffice at most where the step is shorter than it could be.
        let short = room <= self.next || self.next == 0.0;
        let (most, mut order) = (self.most, 1);
        let (mut before, mut small, mut power) = (f64::INFINITY, false, room);
        let mut earlier = if short { [1.0 / self.relative, self.largest(1, room) * room] } else { [0.0; 2] };
        self.doubtful = false;
        while order < most && (!small || self.all_terms) {
            expand(order, &mut self.coefficients);
            order += 1;
            power *= room;
            if short {
                let term = self.largest(order, room) * power;
                small = before.max(term) <= SMALL_TERM;
                if small {
                    self.doubtful = is_sudden(earlier, before.max(term));
                }
                if before.is_finite() {
                    earlier = [earlier[1], before];
                }
                before = term;
            }
        }
        self.counts.evaluations += order as u64 - 1;
        self.order = order;
        let length = if small { room } else { self.length(order, room) };
        self.doubtful |= !small && self.ends_suddenly(order, length);
        if !length.is_finite() || length == 0.0 && self.coefficients.iter().any(|x| !x.is_finite()) {
            return Err(StepError::NotFinite { time: self.time });
        }
        if length < least_step(self.time) {
            return Err(StepError::StepTooSmall { time: self.time, step: length });
        }
        self.next = if small { self.next.max(room) } else { length };
        let end = if room <= 1.01 * length { until } else { self.time + length };
        (self.previous_time, self.time) = (self.time, end);
        std::mem::swap(&mut self.previous, &mut self.state);
        self.end_at(end);
        if self.state.iter().any(|x| !x.is_finite()) {
            self.time = self.previous_time;
            self.state.copy_from_slice(&self.previous);
            return Err(StepError::NotFinite { time: self.time });
        }
        self.counts.accepted += 1;
        Ok(())
    }

    /// Whether the last two terms of a step are smaller than their extrapolation from those before them.
    fn ends_suddenly(&self, order: usize, length: f64) -> bool {
        // Logarithms of the terms, the last one first.
        let (long, accuracy) = (ln(length), -ln(self.relative));
        let terms = self.largest_of_last(order, length);
        let term = |k: usize| if order > k { ln(terms[k]) + (order - k) as f64 * long } else { f64::NEG_INFINITY };
        let terms: [f64; BEFORE + 2] = std::array::from_fn(term);
        let last = terms[0].max(terms[1]);
        // With an even decay the whole, 1/relative tolerances, falls to one.
        let too_large = |k: usize| terms[k] > ln(ABOVE) + accuracy * k as f64 / order as f64;
        last < ln(TOO_SMALL) || last > ln(FALL) + terms[2].max(terms[3]) || (2..terms.len()).any(too_large)
    }

    /// [`largest`](Self::largest) of an order and those before it.
    fn largest_of_last(&self, order: usize, length: f64) -> [f64; BEFORE + 2] {
        let mut most = [0.0; BEFORE + 2];
        for (i, absolute) in self.absolute.iter().enumerate() {
            let x = self.of(0)[i];
            let size = x.abs().max((x + length * self.of(1)[i]).abs());
            let per = 1.0 / (absolute + self.relative * size);
            for (k, most) in most.iter_mut().enumerate().take(order) {
                let part = self.of(order - k)[i].abs() * per;
                // A value that is not a number counts.
                *most = if part <= *most { *most } else { part };
            }
        }
        most
    }

    /// Checks whether the last step follows the motion, at its end and inside, and shortens it until it does: the
    /// truncation of the series makes its slope differ from the rates. Where its terms are inconclusive, the difference
    /// may be at most a tolerance. Rounding errors decrease slowly with the length, and are ignored.
    pub(super) fn sample_interior(&mut self, mut rates: impl FnMut(f64, &[f64], &mut [f64])) -> Result<(), StepError> {
        let doubtful = std::mem::take(&mut self.doubtful);
        // Terms that have decayed before the last ones belong to a motion that continues: as between two samples.
        // Vanishing terms are inconclusive.
        let brief = self.order < self.most && self.of(self.order).iter().any(|term| *term != 0.0);
        let most = if doubtful { 1.0 } else { SLOPE_DEFECT + self.rounding.tolerances };
        let mut memory = [&mut self.rates, &mut self.inside, &mut self.slopes].map(std::mem::take);
        let mut before = f64::INFINITY;
        let found = loop {
            let length = self.time - self.previous_time;
            if length < least_step(self.time) {
                break Err(StepError::StepTooSmall { time: self.previous_time, step: length });
            }
            let places = if brief { &INSIDE[1..] } else { &INSIDE };
            let slope_defect = self.slope_defect((length, places), &mut memory, &mut rates);
            let rounding = slope_defect * self.relative < SLIGHT && slope_defect > ROUNDING * before;
            if slope_defect <= most || rounding {
                break Ok(());
            }
            before = slope_defect;
            self.end_earlier(0.5);
        };
        [self.rates, self.inside, self.slopes] = memory;
        if found.is_err() {
            self.time = self.previous_time;
            self.state.copy_from_slice(&self.previous);
        }
        found
    }

    /// The difference of the slope of the last step from the rates, in tolerances over its length, at most at the
    /// checked places.
    fn slope_defect(
        &mut self,
        (length, places): (f64, &[f64]),
        [slope, inside, own]: &mut [Vec<f64>; 3],
        rates: &mut impl FnMut(f64, &[f64], &mut [f64]),
    ) -> f64 {
        places.iter().fold(0.0, |most: f64, part| {
            let at = self.previous_time + part * length;
            self.value_and_slope(at - self.previous_time, inside, own);
            rates(at, inside, slope);
            self.counts.evaluations += 1;
            let parts = self.absolute.iter().enumerate().map(|(k, absolute)| {
                let size = self.previous[k].abs().max(self.state[k].abs()).max((length * self.of(1)[k]).abs());
                (slope[k] - own[k]).abs() * length / (absolute + self.relative * size)
            });
            // A value that is not a number does not follow the motion either.
            parts.fold(most, |most: f64, part| if part <= most { most } else { part })
        })
    }

    /// The state at a time after the begin of the last step, and the slope of its series there.
    fn value_and_slope(&self, later: f64, value: &mut [f64], slope: &mut [f64]) {
        for first in (0..value.len()).step_by(LANES) {
            let (mut values, mut slopes) = ([0.0; LANES], [0.0; LANES]);
            for order in (0..=self.order).rev() {
                let coefficients = self.lanes(order, first);
                for k in 0..LANES {
                    slopes[k] = slopes[k] * later + values[k];
                    values[k] = values[k] * later + coefficients[k];
                }
            }
            put(&mut value[first..], values);
            put(&mut slope[first..], slopes);
        }
    }

    /// Ends the last step earlier, at a part of it.
    pub(super) fn end_earlier(&mut self, part: f64) {
        let length = part * (self.time - self.previous_time);
        self.end_at(self.previous_time + length);
        self.next = length;
        self.counts.rejected += 1;
    }

    /// Ends the last step at a time that its series reaches; the step size selection is unchanged.
    pub(super) fn end_at(&mut self, time: f64) {
        self.time = time;
        let mut state = std::mem::take(&mut self.state);
        self.interpolate(time, &mut state);
        self.state = state;
    }

    /// Measures the rounding error of the last step from time to time: the lengths of steps do not depend on it.
    pub(super) fn check_rounding(&mut self, mut rates: impl FnMut(f64, &[f64], &mut [f64])) {
        if !self.counts.accepted.is_multiple_of(CHECK_ROUNDING) {
            return;
        }
        let Self { previous, previous_time, coefficients, time, rounding, absolute, relative, .. } = self;
        let slope = &coefficients[previous.len()..];
        rounding.measure(previous, |perturbed, change| {
            rates(*previous_time, perturbed, change);
            change.iter_mut().zip(slope).for_each(|(change, slope)| *change -= slope);
        });
        let sizes = absolute.iter().zip(&*previous).map(|(absolute, x)| absolute + *relative * x.abs());
        rounding.in_step(*time - *previous_time, sizes);
    }

    /// The largest coefficient of an order, in tolerances of components that move for this time.
    fn largest(&self, order: usize, length: f64) -> f64 {
        let of = |order: usize| self.of(order).iter();
        let lists = of(0).zip(of(1)).zip(of(order)).zip(&self.absolute);
        lists.fold(0.0, |most, (((x, slope), term), absolute)| {
            let size = x.abs().max((x + length * slope).abs());
            let part = term.abs() / (absolute + self.relative * size);
            // A value that is not a number counts.
            if part <= most { most } else { part }
        })
    }

    /// The coefficients of an order.
    fn of(&self, order: usize) -> &[f64] {
        let n = self.absolute.len();
        &self.coefficients[order * n..][..n]
    }

    /// Some coefficients of an order, from one on: beyond the last one are others.
    fn lanes(&self, order: usize, first: usize) -> [f64; LANES] {
        let begin = order * self.absolute.len() + first;
        std::array::from_fn(|k| self.coefficients[begin..begin + LANES][k])
    }

    /// The length at which the last two terms are as large as the tolerance; NaN if these are zero.
    fn length(&self, order: usize, room: f64) -> f64 {
        // The sizes that tolerances are relative to depend on the length, weakly.
        let about = if self.next == 0.0 { 0.0 } else { self.next.min(room) };
        let at = |order: usize| exp(-ln(self.largest(order, about)) / order as f64);
        let (last, before) = (at(order), at(order - 1));
        if last.is_nan() || before.is_nan() { f64::NAN } else { (SAFETY * last.min(before)).min(room) }
    }

    /// Whether all rates are exactly zero where it started.
    pub(super) fn rests(&self) -> bool {
        self.begun.is_some() && self.of(1).iter().all(|slope| *slope == 0.0)
    }

    /// Keeps the state constant until a time.
    pub(super) fn rest(&mut self, until: f64) {
        self.previous.copy_from_slice(&self.state);
        (self.previous_time, self.time) = (self.time, until);
        self.order = 0;
        self.coefficients[..self.state.len()].copy_from_slice(&self.state);
        self.begun = None;
        self.counts.accepted += 1;
    }

    /// The state within the last step.
    pub(super) fn interpolate(&self, time: f64, out: &mut [f64]) {
        let later = time - self.previous_time;
        for first in (0..out.len()).step_by(LANES) {
            let mut values = [0.0; LANES];
            for order in (0..=self.order).rev() {
                let coefficients = self.lanes(order, first);
                for k in 0..LANES {
                    values[k] = values[k] * later + coefficients[k];
                }
            }
            put(&mut out[first..], values);
        }
    }
}
