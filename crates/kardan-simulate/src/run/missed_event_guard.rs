//! Events that the error of a step does not detect: points where the loop has a jump or kink by its state, and limits
//! that approach through quantities that no state depends on, such as a load on a body at rest, or a gap between a
//! coasting body and a driven one.
//!
//! Steps that may have missed such an event are shortened.

use kardan_rt::functions::powi;

use super::event_samples::{EVENT_SCAN_POINTS, Guard, is_coarse};
use super::{Outcome, RunLoop, failed};
use crate::halving::halved;
use crate::integrator::Integrator;
use crate::machine::Prospect;

/// Part of a step in which the error estimate covers a kink: there a loop may chatter at one point.
const SOON: f64 = 0.01;
/// The part of such a step that is made instead.
const LESS: f64 = 0.25;
/// The least length of a step, as a part of the time of a run, that is shortened.
const LEAST: f64 = 1e-9;
/// Steps that end where a law has a jump or kink, each this close to the one before, as a part of the duration or of a
/// second, after which a run ends: it would need a thousand million of them.
const TO_AND_FRO: usize = 2000;
const ADJACENT: f64 = 1e-9;
/// The distance by which a series step ends after such a point, as a part of it, doubled each time that it is met again:
/// where a number only touches zero its rounding lasts longer than that. At most this part of what counts as adjacent.
const BEHIND: f64 = 1e-13;
const MOST_BEHIND: f64 = 0.02;
/// The distance after a jump at which a step begins, four times as far each time.
const MOST_JUMPS: usize = 16;
/// The allowed difference of series from their values, in parts of their terms.
const DIFFERENCE: f64 = 1e-6;
/// In a shorter step a difference shrinks below this part; a rounding error does not, and is small.
const ROUNDING: f64 = 0.5;
const SLIGHT: f64 = 1e-2;
/// The checked places, in parts of the step.
const PLACES: [f64; 2] = [0.381_966, 1.0];

impl RunLoop {
    /// Ends the last step where the law may have a feature that the step has not resolved: a pulse, a switch, a detent
    /// that is flat where the step begins. The part before is proven to be negligible, or resolved.
    pub(super) fn resolve(&mut self) -> Result<(), Outcome> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let resolved = match &self.solver {
            Integrator::Taylor(solver) => self.machine.series_resolve(to - from, solver.order),
            Integrator::Dop853(_) | Integrator::Radau(_) => self.machine.notes_resolve(),
        };
        if resolved {
            return Ok(());
        }
        let Self { machine, solver, between, tolerance, absolute, .. } = self;
        let tolerances = (tolerance.relative, &absolute[..]);
        let end = machine.resolved_until((from, to), between, |at, out| solver.interpolate(at, out), tolerances);
        if end < to { self.shorten(end) } else { Ok(()) }
    }

    /// Where the last step must end, before a time, so that it misses no event.
    pub(super) fn missed_event(&mut self, until: f64) -> Result<Option<f64>, Outcome> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let shorter = self.guard.coarse && self.is_long(until) && until == to;
        let shorter = shorter.then_some(from + LESS * (to - from));
        if matches!(self.solver, Integrator::Taylor(_)) {
            return Ok(shorter);
        }
        let kink = if self.machine.kinks.of_state == 0 { None } else { self.kink(until)? };
        let Some(at) = kink.or(shorter) else { return Ok(None) };
        // Within a step the states are less accurate than at its end, and the part after a jump has corrupted them.
        self.shorten_step(at)?;
        let again = if kink.is_some() { self.kink(self.solver.time())? } else { None };
        Ok(Some(again.unwrap_or(self.solver.time())))
    }

    /// Ends a series step just after the loop has a jump or kink by its state: its series are those of one side. Returns whether the step only leaves a
    /// jump at its begin, so that what happens in it happens behind the jump.
    pub(super) fn end_at_kink(&mut self) -> Result<bool, Outcome> {
        let Integrator::Taylor(solver) = &self.solver else { return Ok(false) };
        let (from, to, order) = (solver.previous_time, solver.time, solver.order);
        let (mut length, whole) = (to - from, to - from);
        let jump = self.machine.begins_with_jump();
        self.guard.jumps = if jump { self.guard.jumps + 1 } else { 0 };
        let at = loop {
            let (found, kink_free) = self.machine.kink((length, order), self.tolerance.relative);
            length = kink_free;
            match found {
                Prospect::Leaves(part) => {
                    let at = from + part * length;
                    self.count_kinks(at, None)?;
                    // After it by more than rounding, and by more where that was not enough.
                    let behind = match jump {
                        true => BEHIND * whole * powi(4.0, self.guard.jumps.min(MOST_JUMPS) as i32),
                        false => {
                            let most = MOST_BEHIND * ADJACENT * self.scenario.duration.min(1.0);
                            (BEHIND * whole * powi(2.0, self.guard.bent as i32)).min(most.max(BEHIND * whole))
                        }
                    };
                    break at + behind.max(4.0 * f64::EPSILON * at.abs());
                }
                Prospect::Unknown if length > LEAST * self.scenario.duration.min(to) => length *= LESS,
                _ => break from + length,
            }
        };
        if at < to {
            self.shorten(at)?;
        }
        Ok(jump)
    }

    /// The first point within the last step, up to a time, at which the loop has a jump or kink by its state: just
    /// after it. A step that is too long to decide ends within.
    fn kink(&mut self, until: f64) -> Result<Option<f64>, Outcome> {
        let mut numbers = std::mem::take(&mut self.guard.numbers);
        let found = self.kink_before(until, &mut numbers);
        self.guard.numbers = numbers;
        if let Some((at, Some(kink))) = found {
            self.count_kinks(at, Some(kink))?;
        }
        Ok(found.map(|(at, _)| at))
    }

    /// Ends the run where it returns to the same point repeatedly without progress.
    fn count_kinks(&mut self, at: f64, kink: Option<usize>) -> Result<(), Outcome> {
        let near = ADJACENT * self.scenario.duration.min(1.0);
        let Guard { bent, bent_at, .. } = &mut self.guard;
        *bent = if at - *bent_at <= near { *bent + 1 } else { 0 };
        *bent_at = at;
        if *bent <= TO_AND_FRO {
            return Ok(());
        }
        let what =
            kink.or_else(|| self.nearest_kink()).map_or("a position".into(), |kink| self.machine.describe_kink(kink));
        self.observe_until(self.time, None);
        Err(failed(
            self.time,
            format!(
                "the motion chatters at {what} = 0, where a law has a jump or kink (`sign`, `abs`, `if`, the points of a table): more than {TO_AND_FRO} \
                 crossings, each within {near:.0e} s of the one before. Give the law a finite slope there, such as `x/sqrt(x^2 + x_0^2)` in place of `sign(x)`, or replace the law by \
                 a friction or a stop"
            ),
        ))
    }

    /// With the number that vanishes there, where it is one.
    fn kink_before(&mut self, until: f64, numbers: &mut [f64]) -> Option<(f64, Option<usize>)> {
        let (from, count) = (self.solver.previous_time(), self.machine.kinks.of_state);
        let (found, sides) = numbers.split_at_mut((EVENT_SCAN_POINTS.len() + 1) * count);
        // Rounding may carry the last one beyond the step.
        let later = |row: usize| (from + EVENT_SCAN_POINTS[row - 1] * (until - from)).min(until);
        let time = |row: usize| if row == 0 { from } else { later(row) };
        self.kinks_at(from, &mut found[..count]);
        sides.copy_from_slice(&found[..count]);
        for row in 1..=EVENT_SCAN_POINTS.len() {
            let now = &mut found[row * count..][..count];
            self.kinks_at(time(row), now);
            // A number that begins at zero has the side to which it moves.
            sides.iter_mut().zip(&*now).for_each(|(side, now)| *side = if *side == 0.0 { *now } else { *side });
            if passed(sides, now).is_some() {
                return self.first_kink(sides, (time(row - 1), time(row)), (now, until));
            }
        }
        let coarse = |k: usize| is_coarse(EVENT_SCAN_POINTS.len() + 1, 0.0, |row| (time(row), found[row * count + k]));
        (self.is_long(until) && (0..count).any(coarse)).then_some((from + LESS * (until - from), None))
    }

    /// Whether the last step up to a time is long enough to be shortened.
    fn is_long(&self, until: f64) -> bool {
        until - self.solver.previous_time() > LEAST * self.scenario.duration.min(until)
    }

    /// Just after the first point between two samples at which a number changes its side; `now` is memory for them.
    fn first_kink(
        &mut self,
        sides: &[f64],
        (low, high): (f64, f64),
        (now, until): (&mut [f64], f64),
    ) -> Option<(f64, Option<usize>)> {
        let from = self.solver.previous_time();
        let mut kink = passed(sides, now);
        let (_, at) = halved(low, high, 0.0, |middle| {
            self.kinks_at(middle, now);
            let found = passed(sides, now);
            kink = found.or(kink);
            found.is_some()
        });
        (at - from > SOON * (until - from)).then_some((at, kink))
    }

    /// The number nearest to zero at the begin of the last step.
    fn nearest_kink(&mut self) -> Option<usize> {
        let mut numbers = vec![0.0f64; self.machine.kinks.of_state];
        self.kinks_at(self.solver.previous_time(), &mut numbers);
        (0..numbers.len()).min_by(|a, b| numbers[*a].abs().total_cmp(&numbers[*b].abs()))
    }

    fn kinks_at(&mut self, time: f64, out: &mut [f64]) {
        self.solver.interpolate(time, &mut self.trial_state);
        self.machine.evaluate_kinks(time, &self.trial_state, out);
    }

    /// Shortens a series step until the quantities that the modes depend on agree with the series, except for rounding,
    /// which decreases slowly with the length.
    pub(super) fn check_against_series(&mut self) {
        let mut before = f64::INFINITY;
        while let Integrator::Taylor(solver) = &self.solver
            && self.is_long(solver.time)
        {
            let (from, length, order) = (solver.previous_time, solver.time - solver.previous_time, solver.order);
            let mut most = 0.0f64;
            for place in PLACES {
                let at = from + place * length;
                self.solver.interpolate(at, &mut self.trial_state);
                self.machine.evaluate(at, &self.trial_state);
                most = most.max(self.machine.difference_of_series(place * length, order));
            }
            if most <= DIFFERENCE || most < SLIGHT && most > ROUNDING * before {
                return;
            }
            before = most;
            let less = kardan_rt::functions::powf(DIFFERENCE / most, 1.0 / order as f64).clamp(0.1, 0.7);
            if let Integrator::Taylor(solver) = &mut self.solver {
                solver.end_earlier(less);
            }
        }
    }
}

/// The first of some numbers that has changed its sign.
fn passed(sides: &[f64], now: &[f64]) -> Option<usize> {
    sides.iter().zip(now).position(|(side, now)| side * now < 0.0)
}
