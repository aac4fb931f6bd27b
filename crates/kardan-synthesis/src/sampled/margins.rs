//! Margins of a loop: sample rate, delay, lag and gain, each searched on the exact linear loop.

use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::Arc;

use kardan_rt::functions::{ln, powi};

use super::{ControlLoop, Lifted, LoopBlocks, LoopPlant, SampledLoop, SampledPart, Slowest, Wire};
use crate::margins::Response;
use crate::{Clock, Law};
use kardan_math::num::{Matrix, bracket, eigenvalues};

/// Steps of the searches, as a factor.
pub const LIMIT_STEP: f64 = 1.04;
/// Half periods of a motion of the plant in one sample around which the search is fine, and how fine.
const HALF_TURNS: u32 = 4;
const BESIDE: [f64; 9] = [0.99, 0.995, 0.998, 0.999, 1.0, 1.001, 1.002, 1.005, 1.01];
/// The golden section, and how often it is taken.
const GOLDEN: f64 = 0.618_033_988_749_894_8;
const SECTIONS: usize = 16;
/// Shortest and longest sample time and lag that are tried, s.
const RANGE: [f64; 2] = [1e-6, 1.0];
/// Largest factor of the loop gain that is tried, up and down.
pub const GAINS: f64 = 100.0;
/// Steps per sample time in which the delay of one motor is tried.
const LATE_STEPS: f64 = 10.0;
/// Longest delay that is tried, in sample times.
const DELAYS: f64 = crate::LONGEST_DELAY;

/// A controller in its loop, to be changed.
pub struct Survey<'a> {
    /// The plant.
    pub plant: &'a LoopPlant,
    /// All laws, as designed (not yet sampled, unless they are so by nature).
    pub laws: &'a [Arc<dyn Law>],
    /// Their clocks.
    pub clocks: &'a [Option<Clock>],
    /// The controller that is changed.
    pub number: usize,
    /// Blocks in the loop. The search for another sample time leaves them unchanged, as they have sample times of their own.
    pub blocks: &'a LoopBlocks,
}

/// The loop with something changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Change {
    /// The clock of the controller.
    pub clock: Option<Clock>,
    /// Least lag of all motors of the controller, s; `None`: as they are.
    pub lag: Option<f64>,
    /// Factor of its torques.
    pub gain: f64,
    /// Which of its motors that factor is for; `None`: all of them.
    pub motor: Option<usize>,
    /// Additional delay of the commands to that motor, on top of the delay of the clock, s; of a sampled controller.
    pub late: f64,
}

/// Where a loop becomes unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The value that the loop just tolerates; infinite if all tried values are tolerated.
    pub value: f64,
    /// The angular frequency of the motion that grows beyond the limit, rad/s; zero if it does not oscillate.
    pub frequency: f64,
}

impl Survey<'_> {
    /// The loop as it is.
    pub fn unchanged(&self) -> Change {
        Change { clock: self.clocks[self.number], lag: None, gain: 1.0, motor: None, late: 0.0 }
    }

    /// The loop with a change: its parts and its plant; `None` if a number overflows or a law cannot have that clock.
    fn changed(&self, change: Change) -> Option<(Vec<SampledPart>, LoopPlant)> {
        let mut plant = self.plant.clone();
        let mut parts = Vec::new();
        let period = |clock: &Option<Clock>| clock.map(|clock| clock.period);
        let moved = self.moves(change);
        for (number, (law, own)) in self.laws.iter().zip(self.clocks).enumerate() {
            // While the sample time is searched for, others with the same clock keep step, and those with another one have none.
            let same = period(&self.clocks[self.number]) == period(own);
            let clock = match (own, change.clock) {
                _ if number == self.number => change.clock,
                (Some(own), Some(Clock { period, .. })) if moved && law.clock().is_none() => {
                    same.then(|| Clock { period, delay: own.delay / own.period * period, ..*own })
                }
                _ => *own,
            };
            let mut part = SampledPart::at(&**law, self.plant, clock)?;
            if moved {
                // While the sample time is searched for, sensors keep step too.
                part.slow.clear();
            }
            if number == self.number {
                let changed = |motor: &usize| change.motor.is_none_or(|one| one == *motor);
                (0..part.gains.len()).filter(changed).for_each(|motor| part.gains[motor] = change.gain);
                let wire = |input: usize| Wire { input, delay: change.late };
                part.wire = change.motor.filter(|_| change.late > 0.0).map(wire);
                if let Some(lag) = change.lag {
                    part.inputs.iter().for_each(|input| plant.lags[*input] = plant.lags[*input].max(lag));
                }
            }
            parts.push(part);
        }
        let parts = if self.has_blocks(change) { self.blocks.join(parts) } else { parts };
        Some((parts, plant))
    }

    /// Whether a change has another sample time.
    fn moves(&self, change: Change) -> bool {
        let period = |clock: Option<Clock>| clock.map(|clock| clock.period);
        period(change.clock) != period(self.clocks[self.number])
    }

    /// Whether the changed loop closes through blocks.
    fn has_blocks(&self, change: Change) -> bool {
        !self.blocks.is_empty() && (self.blocks.is_continuous() || !self.moves(change))
    }

    /// The motion of the changed loop that grows most, but for uncontrolled rigid-body modes; `None` if it cannot be computed.
    pub fn slowest(&self, change: Change) -> Option<Slowest> {
        let (parts, plant) = self.changed(change)?;
        let excluded = if parts.iter().all(|part| part.clock.is_none()) { 0 } else { self.free_count(change) };
        Slowest::of(&plant, &parts, excluded)
    }

    /// The number of uncontrolled rigid-body modes in continuous time: sampling may move them a little, but they stay uncontrolled.
    fn free_count(&self, change: Change) -> usize {
        self.free_motions(change).map_or(0, |free| free.columns())
    }

    /// The uncontrolled rigid-body modes of the changed loop in continuous time, columns whose first entries are `[q_r; q̇_r]`; `None`
    /// if a law has no such form.
    pub fn free_motions(&self, change: Change) -> Option<Matrix<f64>> {
        if self.laws.iter().any(|law| law.clock().is_some()) || self.has_blocks(change) {
            return None;
        }
        let (clocks, blocks) = (vec![None; self.clocks.len()], LoopBlocks::default());
        let other =
            Survey { plant: self.plant, laws: self.laws, clocks: &clocks, number: self.number, blocks: &blocks };
        let (parts, plant) = other.changed(Change { clock: None, ..change })?;
        Some(SampledLoop::at_zero_of(&plant, &parts)?.motions)
    }

    /// The uncontrolled rigid-body modes of the unchanged loop, columns whose first entries are `[q_r; q̇_r]`; `None` if they cannot be computed.
    pub fn free(&self) -> Option<Matrix<f64>> {
        let (parts, plant) = self.parts()?;
        if parts.iter().all(|part| part.clock.is_none()) {
            return Some(SampledLoop::at_zero_of(&plant, &parts)?.motions);
        }
        SampledLoop::new(&plant, &parts).ok()?.free()
    }

    /// The loop as errors of the motors' torques see it; see [`ControlLoop::motors`].
    pub fn motors(&self) -> Option<Response> {
        let (parts, plant) = self.changed(self.unchanged())?;
        ControlLoop { plant: &plant, parts: &parts, number: self.number }.motors()
    }

    /// The parts of the loop as they are, and its plant.
    pub fn parts(&self) -> Option<(Vec<SampledPart>, LoopPlant)> {
        self.changed(self.unchanged())
    }

    /// The first value along a path at which the loop is unstable, from one at which it is stable; `None` if it is not stable
    /// at the first.
    fn first(
        &self,
        values: impl Iterator<Item = f64>,
        excluded: usize,
        change: impl Fn(f64) -> Change,
    ) -> Option<Limit> {
        let search = Search { survey: self, excluded, change, free: Cell::new(None), whole: Cell::new(true) };
        let grows = |value: f64| search.grows(value);
        let exactly = |value: f64| search.grows_exactly(value);
        let limit = |[before, beyond]: [(f64, f64); 2]| {
            let ends = [before, beyond].map(|(value, _)| (value, exactly(value)));
            let [low, high] = bracket(ends, 1e-13 * beyond.0.abs(), exactly);
            let frequency = search.slowest(high).map_or(0.0, |found| found.frequency);
            Limit { value: low, frequency }
        };
        // The last two that are stable.
        let mut before: [Option<(f64, f64)>; 2] = [None; 2];
        for value in values {
            let found = (value, grows(value));
            // Where it comes closest to growing between steps it may grow.
            if let [Some(first), Some(middle)] = before
                && middle.1 > first.1
                && middle.1 > found.1
                && let Some(peak) = growing_between([first, middle, found], grows)
            {
                let inside = (middle.0 - first.0).abs() < (peak.0 - first.0).abs();
                return Some(limit([if inside { middle } else { first }, peak]));
            }
            if found.1 < 0.0 {
                before = [before[1], Some(found)];
                continue;
            }
            return Some(limit([before[1]?, found]));
        }
        before[1].map(|_| Limit { value: f64::INFINITY, frequency: 0.0 })
    }

    /// Sample times that are tried: in steps, and finely where half periods of a motion of the plant fill one, in which the samples do not show the motion
    /// and it may grow within a narrow band.
    fn periods(&self) -> Vec<f64> {
        let mut all: Vec<f64> = path(RANGE[0], RANGE[1]).collect();
        let poles = eigenvalues(&self.plant.first_order().a).unwrap_or_default();
        for (_, frequency) in poles.into_iter().filter(|pole| pole.1 > 0.0) {
            let half_turns = (1..=HALF_TURNS).map(|k| PI * f64::from(k) / frequency);
            all.extend(half_turns.flat_map(|period| BESIDE.map(|beside| period * beside)));
        }
        all.retain(|period| (RANGE[0]..=RANGE[1]).contains(period));
        all.sort_by(f64::total_cmp);
        all
    }

    /// The longest sample time, s, that the loop tolerates with a delay that is this part of it: of those that are tried, all shorter ones are
    /// tolerated too. `None` if none is, or the law is made for one sample time.
    pub fn longest_period(&self, delay: f64) -> Option<Limit> {
        let single = self.clocks[self.number].is_some_and(|clock| clock.single);
        self.first(self.periods().into_iter(), 0, |period| Change {
            clock: Some(Clock { period, delay: delay * period, single }),
            ..self.unchanged()
        })
    }

    /// The longest delay of the controller, s, that the loop tolerates; `None` if it has no clock or is unstable as it is.
    pub fn longest_delay(&self) -> Option<Limit> {
        let clock = self.clocks[self.number]?;
        let more = (1..=(20.0 * DELAYS) as usize).map(|k| clock.period * k as f64 / 20.0);
        let delays = std::iter::once(clock.delay).chain(more.filter(|delay| *delay > clock.delay));
        self.first(delays, 0, |delay| Change { clock: Some(Clock { delay, ..clock }), ..self.unchanged() })
    }

    /// The longest lag of all motors of the controller, s, that the loop tolerates (those with more keep theirs); `None` if it is
    /// unstable as it is.
    pub fn longest_lag(&self) -> Option<Limit> {
        let inputs = SampledPart::of(&*self.laws[self.number], self.plant).inputs;
        let now = inputs.iter().map(|input| self.plant.lags[*input]).fold(f64::INFINITY, f64::min);
        let more = path(RANGE[0], RANGE[1]).filter(|lag| *lag > now);
        self.first(std::iter::once(now).chain(more), 0, |lag| Change { lag: Some(lag), ..self.unchanged() })
    }

    /// How much later its commands may reach one motor of the sampled controller, s: the least delay, in addition to that of the clock,
    /// at which the exact map is unstable. Tried every tenth of a sample, up to ten samples, then halved until it is known to
    /// rounding. `None` if the controller has no clock or the loop is unstable as it is.
    pub fn motor_delay(&self, motor: usize) -> Option<Limit> {
        let period = self.clocks[self.number]?.period;
        let free = self.slowest(self.unchanged())?.excluded;
        let steps = (0..=(LATE_STEPS * DELAYS) as usize).map(|k| period * k as f64 / LATE_STEPS);
        self.first(steps, free, |late| Change { motor: Some(motor), late, ..self.unchanged() })
    }

    /// The map over the common period of all clocks, for complex factors of one motor of the sampled controller; `None` if it has
    /// no clock, or there is no such map.
    pub fn lifted(&self, motor: usize) -> Option<Lifted> {
        let (mut parts, plant) = self.changed(self.unchanged())?;
        let part = &mut parts[self.number];
        part.clock?;
        part.wire = Some(Wire { input: motor, delay: 0.0 });
        let found = SampledLoop::new(&plant, &parts).ok()?;
        Lifted::new(found, self.slowest(self.unchanged())?.free)
    }

    /// The factors of the torques of one motor of the controller, or of all of them (`None`), below and above one, that the loop tolerates; `None` if it is
    /// unstable.
    ///
    /// An uncontrolled mode, at zero because the law balances a torque exactly, moves with the factor; as many as there are
    /// are left out, those next to zero.
    pub fn gain_margin(&self, motor: Option<usize>) -> Option<[Limit; 2]> {
        let change = |gain: f64| Change { gain, motor, ..self.unchanged() };
        let free = self.slowest(self.unchanged())?.excluded;
        let up = self.first(path(1.0, GAINS), free, change)?;
        let down = self.first(path(1.0, GAINS).map(|x| 1.0 / x), free, change)?;
        Some([if down.value.is_infinite() { Limit { value: 0.0, ..down } } else { down }, up])
    }
}

/// A search for the first change under which a loop is unstable.
struct Search<'a, F> {
    survey: &'a Survey<'a>,
    /// At least so many motions are left out.
    excluded: usize,
    change: F,
    /// The number of free motions of the last change but for times, and whether it had blocks.
    free: Cell<Option<((Change, bool), usize)>>,
    /// Whether the eigenvalues of the whole map may decide.
    whole: Cell<bool>,
}

impl<F: Fn(f64) -> Change> Search<'_, F> {
    /// Negative where the loop is stable; the size is how fast the motion grows or decays, to rounding.
    fn grows(&self, value: f64) -> f64 {
        self.whole.get().then(|| self.clear_growth(value)).flatten().map_or_else(|| self.grows_exactly(value), ln)
    }

    /// The same with all motions at zero separated from the others.
    fn grows_exactly(&self, value: f64) -> f64 {
        let Some(found) = self.slowest(value) else { return f64::INFINITY };
        // More at zero than are left out anyway: the eigenvalues of the whole map decide nothing.
        self.whole.set(found.free <= self.left_out((self.change)(value)));
        let size = ln(found.growth).abs().max(f64::MIN_POSITIVE);
        if found.stable { -size } else { size }
    }

    fn clear_growth(&self, value: f64) -> Option<f64> {
        let change = (self.change)(value);
        let (parts, plant) = self.survey.changed(change)?;
        let sampled = parts.iter().any(|part| part.clock.is_some());
        sampled.then(|| SampledLoop::new(&plant, &parts).ok()?.clear_growth(self.left_out(change)))?
    }

    fn slowest(&self, value: f64) -> Option<Slowest> {
        let change = (self.change)(value);
        let (parts, plant) = self.survey.changed(change)?;
        if parts.iter().all(|part| part.clock.is_none()) {
            return Slowest::continuous(&plant, &parts, (self.excluded, false));
        }
        SampledLoop::new(&plant, &parts).ok()?.slowest_of((self.left_out(change), false))
    }

    /// How many motions of a sampled loop are left out: it has those in continuous time whatever its sample times are.
    fn left_out(&self, change: Change) -> usize {
        let timeless = (Change { clock: None, late: 0.0, ..change }, self.survey.has_blocks(change));
        let known = self.free.get().filter(|(known, _)| *known == timeless);
        let free = known.map_or_else(|| self.survey.free_count(change), |(_, free)| free);
        self.free.set(Some((timeless, free)));
        self.excluded.max(free)
    }
}

/// Where next to the middle one of three values a function that has one peak there is above zero, if it is found: the golden section of the rest, until
/// the peak stays below zero even if the function rises to it as it has risen from the lower end.
fn growing_between([first, middle, last]: [(f64, f64); 3], grows: impl Fn(f64) -> f64) -> Option<(f64, f64)> {
    let at = |value: f64| (value, grows(value));
    let section = |from: f64, to: f64| to - GOLDEN * (to - from);
    let stays_below = |best: f64, ends: [f64; 2]| best + (best - ends[0].min(ends[1])) < 0.0;
    if stays_below(middle.1, [first.1, last.1]) {
        return None;
    }
    let (mut from, mut to) = (first, last);
    let mut inner = [at(section(from.0, to.0)), at(section(to.0, from.0))];
    for _ in 0..SECTIONS {
        if let Some(found) = inner.into_iter().find(|found| found.1 >= 0.0) {
            return Some(found);
        }
        if stays_below(inner[0].1.max(inner[1].1), [from.1, to.1]) {
            return None;
        }
        if inner[0].1 > inner[1].1 {
            to = inner[1];
            inner = [at(section(from.0, to.0)), inner[0]];
        } else {
            from = inner[0];
            inner = [inner[1], at(section(to.0, from.0))];
        }
    }
    None
}

/// From one value to another in steps of a factor.
fn path(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let steps = (ln(to / from) / ln(LIMIT_STEP)).ceil() as i32;
    (0..=steps).map(move |k| (from * powi(LIMIT_STEP, k)).min(to))
}
