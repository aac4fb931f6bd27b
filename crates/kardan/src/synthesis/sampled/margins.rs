//! How far a loop is from instability: rate, delay, lag and gain, each searched on the exact linear loop.

use super::{Clock, LoopPlant, SampledLoop, SampledPart, Slowest};
use crate::num::eigenvalues;
use crate::synthesis::Law;

/// What of a pole, 1/s, above zero still counts as rounding.
const ROUNDING: f64 = 1e-9;
/// Poles of a loop in continuous time that close to zero, 1/s, belong to motions that are not held (a wheel that nobody grips),
/// and are left out.
const FREE: f64 = 1e-6;
/// Steps of the searches, as a factor.
const STEP: f64 = 1.04;
/// Shortest and longest sample time and lag that are looked at, s.
const RANGE: [f64; 2] = [1e-6, 1.0];
/// Largest factor of the loop gain that is looked at, either way.
const GAINS: f64 = 100.0;
/// Longest delay that is looked at, in sample times.
const DELAYS: f64 = crate::synthesis::LONGEST_DELAY;

/// A controller in its loop, to be changed.
pub struct Survey<'a> {
    /// The plant.
    pub plant: &'a LoopPlant,
    /// All laws, as designed (not yet sampled, unless they are so by nature).
    pub laws: &'a [Box<dyn Law>],
    /// Their clocks.
    pub clocks: &'a [Option<Clock>],
    /// The controller that is changed.
    pub number: usize,
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
}

/// Where a loop becomes unstable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limit {
    /// The value that the loop just tolerates; infinite if all that was looked at is tolerated.
    pub value: f64,
    /// The angular frequency of the motion that grows beyond it, rad/s; zero if it is none.
    pub frequency: f64,
}

impl Survey<'_> {
    /// The loop as it is.
    pub fn unchanged(&self) -> Change {
        Change { clock: self.clocks[self.number], lag: None, gain: 1.0 }
    }

    /// The loop with a change: its parts and its plant; `None` if a number overflows or a law cannot have that clock.
    fn changed(&self, change: Change) -> Option<(Vec<SampledPart>, LoopPlant)> {
        let mut plant = self.plant.clone();
        let mut parts = Vec::new();
        for (number, (law, own)) in self.laws.iter().zip(self.clocks).enumerate() {
            // While the sample time is searched for, others with the same clock keep step, and those with another one have none.
            let period = |clock: &Option<Clock>| clock.map(|clock| clock.period);
            let same = period(&self.clocks[self.number]) == period(own);
            let moved = period(&change.clock) != period(&self.clocks[self.number]);
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
                part.gain = change.gain;
                if let Some(lag) = change.lag {
                    part.inputs.iter().for_each(|input| plant.lags[*input] = plant.lags[*input].max(lag));
                }
            }
            parts.push(part);
        }
        Some((parts, plant))
    }

    /// The motion of the changed loop that grows most; `None` if it cannot be computed.
    pub fn slowest(&self, change: Change) -> Option<Slowest> {
        let (parts, plant) = self.changed(change)?;
        if parts.iter().all(|part| part.clock.is_none()) {
            let poles = eigenvalues(&SampledLoop::flow_of(&plant, &parts))?;
            let held = poles.iter().filter(|(re, im)| re.hypot(*im) > FREE);
            let (re, im) = held.copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, 0.0));
            return Some(Slowest { growth: re.exp(), frequency: im.abs(), stable: re < ROUNDING });
        }
        SampledLoop::new(&plant, &parts).ok()?.slowest()
    }

    /// The first value along a path at which the loop is unstable, from one at which it is stable; `None` if it is not stable
    /// at the first.
    fn first(&self, values: impl Iterator<Item = f64>, change: impl Fn(f64) -> Change) -> Option<Limit> {
        let stable = |value: f64| self.slowest(change(value)).is_some_and(|found| found.stable);
        let mut before: Option<f64> = None;
        for value in values {
            if stable(value) {
                before = Some(value);
                continue;
            }
            let (mut low, mut high) = (before?, value);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                if middle == low || middle == high || (high - low).abs() < 1e-13 * high.abs() {
                    break;
                }
                if stable(middle) { low = middle } else { high = middle }
            }
            let frequency = self.slowest(change(high)).map_or(0.0, |found| found.frequency);
            return Some(Limit { value: low, frequency });
        }
        before.map(|_| Limit { value: f64::INFINITY, frequency: 0.0 })
    }

    /// The longest sample time, s, that the loop tolerates with a delay that is this part of it. All shorter ones are
    /// tolerated too. `None` if none is, or the law is made for one sample time.
    pub fn longest_period(&self, delay: f64) -> Option<Limit> {
        let single = self.clocks[self.number].is_some_and(|clock| clock.single);
        self.first(path(RANGE[0], RANGE[1]), |period| Change {
            clock: Some(Clock { period, delay: delay * period, single }),
            ..self.unchanged()
        })
    }

    /// The longest delay of the controller, s, that the loop tolerates; `None` if it has no clock or is unstable as it is.
    pub fn longest_delay(&self) -> Option<Limit> {
        let clock = self.clocks[self.number]?;
        let more = (1..=(20.0 * DELAYS) as usize).map(|k| clock.period * k as f64 / 20.0);
        let delays = std::iter::once(clock.delay).chain(more.filter(|delay| *delay > clock.delay));
        self.first(delays, |delay| Change { clock: Some(Clock { delay, ..clock }), ..self.unchanged() })
    }

    /// The longest lag of all motors of the controller, s, that the loop tolerates (those with more keep theirs); `None` if it is
    /// unstable as it is.
    pub fn longest_lag(&self) -> Option<Limit> {
        let inputs = SampledPart::of(&*self.laws[self.number], self.plant).inputs;
        let now = inputs.iter().map(|input| self.plant.lags[*input]).fold(f64::INFINITY, f64::min);
        let more = path(RANGE[0], RANGE[1]).filter(|lag| *lag > now);
        self.first(std::iter::once(now).chain(more), |lag| Change { lag: Some(lag), ..self.unchanged() })
    }

    /// The factors of the controller's torques, below and above one, that the loop tolerates; `None` if it is unstable.
    pub fn gain_margin(&self) -> Option<[Limit; 2]> {
        let change = |gain: f64| Change { gain, ..self.unchanged() };
        let up = self.first(path(1.0, GAINS), change)?;
        let down = self.first(path(1.0, GAINS).map(|x| 1.0 / x), change)?;
        Some([if down.value.is_infinite() { Limit { value: 0.0, ..down } } else { down }, up])
    }
}

/// From one value to another in steps of a factor.
fn path(from: f64, to: f64) -> impl Iterator<Item = f64> {
    let steps = ((to / from).ln() / STEP.ln()).ceil() as i32;
    (0..=steps).map(move |k| (from * STEP.powi(k)).min(to))
}
