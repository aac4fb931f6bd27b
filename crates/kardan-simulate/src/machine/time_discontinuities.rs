//! Jumps and kinks of a loop: points that a step of the integrator must not miss.
//!
//! Those that depend on the time alone are found by interval arithmetic in advance: an interval of time whose values
//! exclude zero has no such point. Those that depend on the state are searched within each step.

use super::Machine;
use super::kinks::{Kinks, line_range};
use super::timed::Timed;
use crate::halving::halved;
use kardan_expr::expr::{Expr, Interval};
use kardan_mechanics::reduce::MotionPlan;

/// Most intervals that are searched for one point; beyond that the samples of each step search it.
const INTERVALS: usize = 1000;
/// Part of the time ahead within which there is at most one change of sign, and within which the search stops.
const SINGLE: f64 = 1e-6;
const FINE: f64 = 1e-10;
/// Where an interval is halved: not at typical numbers of a model.
const HALF: f64 = 0.487_139;
/// Values that are zero, rounded outward.
const NOTHING: f64 = 1e-300;

/// A jump or kink of the loop by the time alone: the last number before, and the first one behind it.
pub(crate) type Discontinuity = (f64, f64);

impl Machine {
    /// The first point between two times of the segment with a jump or kink by the time alone.
    pub(crate) fn next_discontinuity(&mut self, from: f64, until: f64) -> Option<Discontinuity> {
        if self.kinks.of_time.is_empty() || !(from < until && until.is_finite()) {
            return None;
        }
        let mut first: Option<Discontinuity> = None;
        for kink in &self.kinks.of_time {
            let until = first.map_or(until, |(low, _)| low);
            first = first_change(&mut self.timed, (&self.kinks, *kink), &self.lines, (from, until)).or(first);
        }
        first
    }

    /// A description of such a number, as text, at the point last evaluated.
    pub(crate) fn describe_kink(&self, kink: usize) -> String {
        let MotionPlan { plan, more, .. } = self.dynamics.plan();
        plan.formatted(more.start + self.places.kinks.start + kink, self.work.values())
    }

    /// The numbers whose zeros these points are, at a time and a state.
    pub(crate) fn evaluate_kinks(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        self.give_loop(time, state);
        let moving = 2 * self.degrees_of_freedom;
        self.kinks.find(&state[..moving], &self.work.values()[moving..], out);
    }
}

/// The first change of sign of one number between two times.
fn first_change(
    timed: &mut Timed,
    (kinks, kink): (&Kinks, Expr),
    lines: &[(f64, f64, f64)],
    (from, until): (f64, f64),
) -> Option<Discontinuity> {
    let at = |timed: &mut Timed, time: f64| {
        let sources = lines.iter().map(|(value, slope, start)| value + slope * (time - start));
        let values: Vec<f64> = sources.chain(timed.at(time).iter().copied()).collect();
        kinks.at(kink, &values)
    };
    let (mut open, mut budget) = (vec![(from, until)], INTERVALS);
    while let Some((low, high)) = open.pop() {
        budget = budget.checked_sub(1)?;
        let span = Interval { low, high };
        let sources = lines.iter().map(|line| line_range(*line, span));
        let ranges: Vec<Interval> = sources.chain(timed.between(span)).collect();
        let values = kinks.between(kink, &ranges);
        let vanishes = values.low.abs() < NOTHING && values.high.abs() < NOTHING;
        if values.low > 0.0 || values.high < 0.0 || vanishes {
            continue;
        }
        let part = (high - low) / (until - from);
        if part <= SINGLE {
            let begin = at(timed, low);
            // A jump at the begin of the segment is handled already.
            if begin == 0.0 && low > from && at(timed, low.next_up()) != 0.0 {
                return Some((low, low.next_up()));
            }
            if begin * at(timed, high) < 0.0 {
                let found = halved(low, high, 0.0, |time| at(timed, time) * begin < 0.0);
                if found.0 > from {
                    return Some(found);
                }
                continue;
            }
        }
        let middle = low + HALF * (high - low);
        if part > FINE && low < middle && middle < high {
            open.extend([(middle, high), (low, middle)]);
        }
    }
    None
}
