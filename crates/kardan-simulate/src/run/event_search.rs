//! Events within the last step: the first time at which a direction leaves its contact state, from the bounds of the series or from samples of
//! the dense output, located to the last bits of the time.

use kardan_rt::functions::powi;

use super::RunLoop;
use super::event_samples::{EVENT_SCAN_POINTS, MOST_SCAN_POINTS};
use crate::halving::halved;
use crate::integrator::Integrator;
use crate::machine::Prospect;

/// The least number in a shortened step.
const LEAST_SCAN_POINTS: usize = 2;
/// Part of a step to which an event is located that the step is to be shortened for.
const ROUGHLY: f64 = 1e-6;
/// Part of a series step before which an event is searched once more, in a step that is this many times as long as the
/// time until it.
const EARLY: f64 = 1e-3;
const CLOSER: f64 = 4.0;
/// Steps of regula falsi towards an event.
const FALSE_POSITIONS: usize = 30;
/// Widenings of the interval about a zero until the modes agree that the event lies in it.
const CONFIRMATIONS: usize = 6;
/// Golden-section steps between two samples for the least margin: 1e-8 of the interval, where a parabola is flat to
/// rounding.
const SECTIONS: usize = 40;
const GOLDEN: f64 = 0.618_033_988_749_894_8;

impl RunLoop {
    /// Whether a mode is left at this time within the last step; fills the lists of directions that leave theirs.
    pub(super) fn leaves(&mut self, time: f64) -> bool {
        self.solver.interpolate(time, &mut self.trial_state);
        self.leaves_equilibrium(time)
    }

    /// The same for the last evaluated state.
    pub(super) fn leaves_equilibrium(&mut self, time: f64) -> bool {
        self.machine.reversed(time, &self.trial_state, &mut self.reversed);
        self.switching = self.machine.drives_switch(time, &self.trial_state);
        !self.reversed.is_empty() || self.switching || self.machine.breaks_away(time, &self.trial_state)
    }

    /// The first event within the last step, where the series locate it and the modes confirm it, or where sampling
    /// finds it; approximate where the step is then repeated. `length` is that of the step, s.
    pub(super) fn find_event(&mut self, length: f64) -> Option<f64> {
        self.guard.coarse = false;
        if self.guard.blind {
            self.check_against_series();
        }
        let length = length.min(self.solver.time() - self.solver.previous_time());
        let (found, first) = self.find_event_within(length)?;
        Some(self.find_closer(found, first))
    }

    /// The end of a step that only leaves a jump at its begin, if a mode is left there.
    pub(super) fn event_behind_jump(&mut self, length: f64) -> Option<f64> {
        let end = self.solver.time();
        self.machine.measure_step(length, self.solver.previous_state(), self.solver.state());
        self.leaves(end).then_some(end)
    }

    /// Searches an event in a series step once more in a shorter one: near the start of a step the rounding error of a
    /// speed is estimated from the speeds of the step, and those at its end may be far larger; and an event that
    /// sampling found, not known to be the `first`, may have hidden an earlier one. Where there is none, the found
    /// event stays.
    fn find_closer(&mut self, mut found: f64, first: bool) -> f64 {
        let mut hides = !first;
        while let Integrator::Taylor(solver) = &mut self.solver {
            let (from, to) = (solver.previous_time, solver.time);
            let early = found - from < EARLY * (to - from);
            let end = if early { from + CLOSER * (found - from) } else { found };
            if !(from < found && found <= end && end < to) || !(early || hides) {
                break;
            }
            hides = false;
            solver.end_at(end);
            let Some((at, _)) = self.find_event_within(end - from) else {
                if let Integrator::Taylor(solver) = &mut self.solver {
                    solver.end_at(to);
                }
                self.machine.measure_step(to - from, self.solver.previous_state(), self.solver.state());
                self.leaves(found);
                break;
            };
            found = at;
        }
        found
    }

    /// [`find_event`](Self::find_event) in the step as it is, and whether it is certainly the first one.
    fn find_event_within(&mut self, length: f64) -> Option<(f64, bool)> {
        match self.solver.prospect(&mut self.machine) {
            Prospect::Stays => return None,
            Prospect::Leaves(part) => {
                self.machine.measure_step(length, self.solver.previous_state(), self.solver.state());
                let zero = self.solver.previous_time() + part * length;
                if let Some((low, high)) = self.confirm(zero) {
                    let (_, high) = halved(low, high, 0.0, |time| self.leaves(time));
                    self.leaves(high);
                    return Some((high, true));
                }
            }
            Prospect::Unknown => {}
        }
        self.search_event(length, !self.solver.shortens()).map(|found| (found, false))
    }

    /// Two times about one at which a mode is left by its series: at the first none is, at the second one is.
    fn confirm(&mut self, zero: f64) -> Option<(f64, f64)> {
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let (mut low, mut high) = (None, None);
        let mut apart = 4.0 * f64::EPSILON * zero.abs();
        for _ in 0..CONFIRMATIONS {
            let (before, after) = ((zero - apart).max(from), (zero + apart).min(to));
            if high.is_none() && self.leaves(after) {
                high = Some(after);
            }
            if low.is_none() && before < after && !self.leaves(before) {
                low = Some(before);
            }
            if let (Some(low), Some(high)) = (low, high) {
                return Some((low, high));
            }
            apart *= 32.0;
        }
        None
    }

    /// The first event within the last step: `exactly`, to the last bits of the time, or to a [`ROUGHLY`] of the step.
    ///
    /// `length` is that of the step before it was shortened, s.
    pub(super) fn search_event(&mut self, length: f64, exactly: bool) -> Option<f64> {
        self.machine.measure_step(length, self.solver.previous_state(), self.solver.state());
        let (from, to) = (self.solver.previous_time(), self.solver.time());
        let friction = !self.machine.modes.is_empty();
        if friction && !self.event_samples.begin(from) {
            self.solver.interpolate(from, &mut self.trial_state);
            self.machine.evaluate(from, &self.trial_state);
            self.event_samples.take(0, from, &mut self.machine);
        }
        // A shortened step needs fewer samples: as many as its part of a whole one.
        let whole = length.max(self.solver.next_step());
        let event_samples = ((MOST_SCAN_POINTS as f64 * (to - from) / whole).ceil() as usize)
            .clamp(LEAST_SCAN_POINTS, MOST_SCAN_POINTS);
        let event_samples = if self.guard.blind { MOST_SCAN_POINTS } else { event_samples };
        let part = |k: usize| {
            if self.guard.blind { EVENT_SCAN_POINTS[k - 1] } else { k as f64 / event_samples as f64 }
        };
        let places: [f64; MOST_SCAN_POINTS] =
            std::array::from_fn(|k| if k < event_samples { part(k + 1) } else { 1.0 });
        let (mut before, mut mode_change) = (from, None);
        for k in 1..=event_samples {
            let at = if k == event_samples { to } else { from + (to - from) * places[k - 1] };
            if at <= before {
                continue;
            }
            let leaves = self.leaves(at);
            mode_change = if leaves { Some(at) } else { self.touched(before, at) };
            if mode_change.is_some() {
                break;
            }
            before = at;
            if friction {
                self.event_samples.take(self.event_samples.count, at, &mut self.machine);
            }
        }
        let dip = if friction { self.dip() } else { None };
        let Some((low, high)) = dip.or(mode_change.map(|at| (before, at))) else {
            self.guard.coarse = self.guard.blind && friction && {
                let machine = &self.machine;
                self.event_samples.are_coarse(|watch| machine.room_noise(watch))
            };
            return None;
        };
        let least = if exactly { 0.0 } else { ROUGHLY * (to - from) };
        let high = self.locate(low, high, least);
        self.leaves(high);
        let Some(earlier) = self.touched(low, high) else { return Some(high) };
        self.leaves(earlier);
        Some(earlier)
    }

    /// The first contact between two samples that is penetrated at the later one without being detected there, as it
    /// opens again already: just after it touches. Needs the directions that leave their mode at the later one.
    fn touched(&mut self, before: f64, at: f64) -> Option<f64> {
        let mut touched = None;
        for watch in 0..self.event_samples.directions {
            if !self.machine.is_apart(watch) || touched.is_none() && self.reversed.contains(&watch) {
                continue;
            }
            // A contact that opened just now is penetrated by rounding.
            let least = self.event_samples.at(0, watch).min(0.0);
            let end = touched.unwrap_or(at);
            if self.margin(end, watch) >= least {
                continue;
            }
            let (_, high) = halved(before, end, 0.0, |time| self.margin(time, watch) < least);
            if self.leaves(high) {
                touched = Some(high);
            }
        }
        touched
    }

    /// The first time at which a mode is left, between one at which none is and one at which one is: the later end of an interval that
    /// is no longer than `least`, or of two neighbouring numbers.
    ///
    /// A mode that is left gives a number that changes its sign: its zero by regula falsi (Illinois: Dowell and
    /// Jarratt, BIT 11, 1971, 168). The modes themselves decide on both sides of it, and bisection reduces the rest.
    fn locate(&mut self, mut low: f64, mut high: f64, least: f64) -> f64 {
        if let Some(zero) = self.leaving_zero(low, high, least) {
            let mut apart = (4.0 * f64::EPSILON * zero.abs()).max(0.25 * least);
            for _ in 0..CONFIRMATIONS {
                let (before, after) = (zero - apart, zero + apart);
                if low < before && before < high {
                    if self.leaves(before) { high = before } else { low = before }
                }
                if low < after && after < high {
                    if self.leaves(after) { high = after } else { low = after }
                }
                if before <= low && high <= after {
                    break;
                }
                apart *= 32.0;
            }
        }
        halved(low, high, least, |time| self.leaves(time)).1
    }

    /// When the direction that leaves its mode at the later of two times reaches its limit; `None` if it is not within
    /// its limit at the first.
    fn leaving_zero(&mut self, low: f64, high: f64, least: f64) -> Option<f64> {
        self.leaves(high);
        let what = self.reversed.first().copied();
        if what.is_none() && self.switching {
            return None;
        }
        let (mut a, mut b) = ((low, self.room(low, what)), (high, self.room(high, what)));
        if !(a.1 > 0.0 && b.1 <= 0.0) {
            return None;
        }
        let close = least.max(f64::EPSILON * high.abs());
        let mut zero = high;
        // The end that the last step kept: its value then counts half.
        let mut retained_end = 0;
        for _ in 0..FALSE_POSITIONS {
            let next = b.0 - b.1 * (b.0 - a.0) / (b.1 - a.1);
            if !(a.0 < next && next < b.0) {
                break;
            }
            let value = self.room(next, what);
            let moved = (next - zero).abs();
            zero = next;
            if moved <= close || value == 0.0 || b.0 - a.0 <= close {
                break;
            }
            if value > 0.0 {
                a = (next, value);
                b.1 *= if retained_end == 1 { 0.5 } else { 1.0 };
                retained_end = 1;
            } else {
                b = (next, value);
                a.1 *= if retained_end == -1 { 0.5 } else { 1.0 };
                retained_end = -1;
            }
        }
        Some(zero)
    }

    /// The distance of a slipping direction from rest at a time within the last step (rad/s), or, without a direction,
    /// of the sticking ones from their limit (as a part of it).
    fn room(&mut self, time: f64, direction: Option<usize>) -> f64 {
        self.solver.interpolate(time, &mut self.trial_state);
        match direction {
            Some(direction) => self.machine.slip_room(time, &self.trial_state, direction),
            None => {
                self.machine.evaluate(time, &self.trial_state);
                self.machine.active_reserve()
            }
        }
    }

    /// A violation that appears and disappears between two samples: a margin that has its minimum there and may fall
    /// below zero. Returns the sample before and a time at which a mode is left.
    fn dip(&mut self) -> Option<(f64, f64)> {
        self.event_samples.measure_curvatures();
        let noise: Vec<f64> = (0..self.event_samples.directions).map(|watch| self.machine.room_noise(watch)).collect();
        for row in 1..self.event_samples.count {
            for watch in 0..self.event_samples.directions {
                let curvature = self.event_samples.curvatures[watch];
                if curvature <= noise[watch] {
                    continue;
                }
                let (left, right) = (self.event_samples.at(row - 1, watch), self.event_samples.at(row, watch));
                // The slope changes by the curvature in a gap, so a margin that falls by more has no minimum in it; and
                // one with a higher value does not reach zero.
                let turns = (right - left).abs() <= curvature && left.min(right) <= curvature;
                if !turns {
                    continue;
                }
                let (begin, end) = (self.event_samples.times[row - 1], self.event_samples.times[row]);
                let (mut low, mut high) = (begin, end);
                let (mut first, mut second) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
                let (mut a, mut b) = (self.margin(first, watch), self.margin(second, watch));
                for _ in 0..SECTIONS {
                    if !(low < first && first < second && second < high) {
                        break;
                    }
                    let (time, least) = if a <= b { (first, a) } else { (second, b) };
                    if least < 0.0 && self.leaves(time) {
                        return Some((begin, time));
                    }
                    // The largest fall that the curvature allows.
                    if !(least <= curvature * powi((high - low) / (end - begin), 2)) {
                        break;
                    }
                    // One of the two points serves again.
                    if a <= b {
                        (high, second, b) = (second, first, a);
                        first = high - GOLDEN * (high - low);
                        a = self.margin(first, watch);
                    } else {
                        (low, first, a) = (first, second, b);
                        second = low + GOLDEN * (high - low);
                        b = self.margin(second, watch);
                    }
                }
            }
        }
        None
    }

    /// The distance of a direction from leaving its mode at a time within the last step.
    fn margin(&mut self, time: f64, direction: usize) -> f64 {
        self.solver.interpolate(time, &mut self.trial_state);
        self.machine.evaluate(time, &self.trial_state);
        self.machine.margin_here(direction)
    }
}
