//! The event sequence over the common period of all clocks of a loop.

use super::SampledPart;
use super::jump::Jump;
use super::places::{Number, Places};
use kardan_math::num::{Matrix, Rational};

/// Parts of the shortest sample time within which two instants are one.
pub(super) const SAME: f64 = 1e-9;
/// Samples, of controllers and slow sensors, within the common period of all clocks.
const MOST_SAMPLES: usize = 1000;

/// The events of a period, in their order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum LoopEvent {
    /// The end of an interval: a controller or sensor computes next.
    Observe,
    /// The error at a place of z is another one from here on.
    Fresh(usize),
    /// z changes.
    Jump(usize),
    /// A command is sent to a motor with an additional delay, at this place of z.
    Launch(usize),
}

/// Why there is no map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SampledLoopError {
    /// No law has a clock.
    #[error("no controller is sampled")]
    Continuous,
    /// The sample times have no short common period.
    #[error("the sample times of controllers and sensors have no common period within {MOST_SAMPLES} samples")]
    NoCommonPeriod,
    /// A number overflows.
    #[error("a number of the sampled loop is not finite")]
    NotFinite,
}

/// Times of a loop, s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Periods {
    /// The common period of all clocks.
    pub period: f64,
    /// The shortest sample time.
    pub shortest: f64,
}

impl Periods {
    /// Of the clocks of parts and of their slow sensors; a loop without any is evaluated every `otherwise` seconds.
    pub fn of(parts: &[SampledPart], otherwise: Option<f64>) -> Result<Self, SampledLoopError> {
        let clocks = || parts.iter().filter_map(|part| part.clock).map(|clock| clock.period);
        let slow = parts.iter().flat_map(|part| &part.slow).map(|(_, sensor)| sensor.period);
        let periods: Vec<f64> = clocks().chain(slow).collect();
        if clocks().next().is_none() {
            let period = otherwise.ok_or(SampledLoopError::Continuous)?;
            return Ok(Self { period, shortest: period });
        }
        let shortest = clocks().fold(f64::INFINITY, f64::min);
        let period = common_period(&periods, shortest).ok_or(SampledLoopError::NoCommonPeriod)?;
        Ok(Self { period, shortest })
    }
}

impl EventSequence<Rational> {
    /// log₂ of how far the map over the period may be off, in the largest sum of sizes in a row, if each jump is off by this much.
    pub fn off(&self, each: f64) -> f64 {
        let sizes: Vec<f64> = self.jumps.iter().map(|jump| jump.log_size().max(0.0)).collect();
        let (mut off, mut size) = (f64::NEG_INFINITY, 0.0);
        for event in &self.events {
            if let LoopEvent::Jump(jump) = event {
                // ‖J‖ off + each ‖M‖, and no more than double that with the product of both.
                off = (off + sizes[*jump]).max(each + size) + 2.0;
                size += sizes[*jump];
            }
        }
        off
    }
}

/// The events that are due at an instant, in their order there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Scheduled {
    Arrive(usize),
    Apply(usize),
    Read(usize, usize),
    /// A task of blocks computes, before the laws that read its outputs.
    Output(usize),
    Compute(usize),
}

/// The change of z over a period that begins with this event.
pub(super) fn map_from<S: Number>(first: usize, events: &[LoopEvent], jumps: &[Jump<S>], size: usize) -> Matrix<S> {
    let mut map = Matrix::identity(size);
    for event in events[first..].iter().chain(&events[..first]) {
        if let LoopEvent::Jump(jump) = event {
            jumps[*jump].change_rows(&mut map);
        }
    }
    map
}

/// The events over a period, during construction.
pub(super) struct EventSequence<S> {
    pub events: Vec<LoopEvent>,
    pub jumps: Vec<Jump<S>>,
    /// Jumps of waiting so long.
    intervals: Vec<(f64, usize)>,
    /// Jumps of the due events.
    scheduled: Vec<(Scheduled, usize)>,
    /// The events after which the torques of each law take effect.
    pub applied: Vec<Vec<usize>>,
    /// The number of events at the first instant, once it is over.
    pub at_first: Option<usize>,
}

impl<S: Number> EventSequence<S> {
    fn new(laws: usize) -> Self {
        let (events, jumps, intervals, scheduled) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { events, jumps, intervals, scheduled, applied: vec![Vec::new(); laws], at_first: None }
    }

    /// The events over the period of these parts, one after the other; `exponential` gives the map over a time without events.
    pub fn over(
        parts: &[SampledPart],
        &Periods { period, shortest }: &Periods,
        places: &Places<'_, S>,
        exponential: impl Fn(f64) -> Option<Jump<S>>,
    ) -> Result<Self, SampledLoopError> {
        let mut event_sequence = Self::new(parts.len());
        let mut time = 0.0;
        for (at, simultaneous) in schedule(parts, period, shortest) {
            if at - time > SAME * shortest {
                event_sequence.wait(at - time, shortest, &exponential)?;
                time = at;
                if simultaneous.iter().any(|what| matches!(what, Scheduled::Output(_) | Scheduled::Compute(_))) {
                    event_sequence.events.push(LoopEvent::Observe);
                }
            }
            simultaneous.into_iter().for_each(|what| event_sequence.execute(what, places, parts));
        }
        if period - time > SAME * shortest {
            event_sequence.wait(period - time, shortest, &exponential)?;
        }
        event_sequence.events.push(LoopEvent::Observe);
        Ok(event_sequence)
    }

    /// The change of z over the period.
    pub fn map(&self, size: usize) -> Matrix<S> {
        map_from(0, &self.events, &self.jumps, size)
    }

    fn wait(
        &mut self,
        length: f64,
        shortest: f64,
        exponential: &impl Fn(f64) -> Option<Jump<S>>,
    ) -> Result<(), SampledLoopError> {
        let cached = self.intervals.iter().find(|(candidate, _)| (candidate - length).abs() < SAME * shortest);
        let jump = match cached {
            Some((_, jump)) => *jump,
            None => {
                self.jumps.push(exponential(length).ok_or(SampledLoopError::NotFinite)?);
                self.intervals.push((length, self.jumps.len() - 1));
                self.jumps.len() - 1
            }
        };
        self.at_first.get_or_insert(self.events.len());
        self.events.push(LoopEvent::Jump(jump));
        Ok(())
    }

    fn execute(&mut self, what: Scheduled, places: &Places<'_, S>, parts: &[SampledPart]) {
        match what {
            Scheduled::Output(law) | Scheduled::Compute(law) => {
                self.events.extend(places.laws[law].fresh().map(LoopEvent::Fresh));
            }
            Scheduled::Read(law, slow) => self.events.extend(places.laws[law].fresh_of(slow).map(LoopEvent::Fresh)),
            Scheduled::Apply(_) | Scheduled::Arrive(_) => {}
        }
        let cached = self.scheduled.iter().find(|(candidate, _)| *candidate == what).map(|(_, jump)| *jump);
        let jump = cached.unwrap_or_else(|| {
            self.jumps.push(match what {
                Scheduled::Output(law) | Scheduled::Compute(law) => places.compute(law),
                Scheduled::Read(law, slow) => places.read(law, slow),
                Scheduled::Apply(law) => places.apply(law),
                Scheduled::Arrive(law) => places.arrive(law),
            });
            self.scheduled.push((what, self.jumps.len() - 1));
            self.jumps.len() - 1
        });
        self.events.push(LoopEvent::Jump(jump));
        let late = |law: usize| parts[law].clock.is_some_and(|clock| clock.delay > 0.0);
        let launching = match what {
            Scheduled::Apply(law) => Some(law),
            Scheduled::Compute(law) if !late(law) => Some(law),
            _ => None,
        };
        if let Some(law) = launching {
            self.events.extend(places.launched(law).map(LoopEvent::Launch));
            self.applied[law].push(self.events.len());
        }
    }
}

/// The events within a period, instant by instant, in the steady state: delayed commands of the period before are in transit.
fn schedule(parts: &[SampledPart], period: f64, shortest: f64) -> Vec<(f64, Vec<Scheduled>)> {
    let mut all: Vec<(f64, Scheduled)> = Vec::new();
    for (number, part) in parts.iter().enumerate() {
        let Some(clock) = part.clock else { continue };
        let samples = |time: f64| (0..(period / time).round() as usize).map(move |k| k as f64 * time);
        for at in samples(clock.period) {
            all.push((at, if part.is_task() { Scheduled::Output(number) } else { Scheduled::Compute(number) }));
            if clock.delay > 0.0 {
                let applied = (at + clock.delay) % period;
                let same = (period - applied).min(applied) < SAME * shortest;
                all.push((if same { 0.0 } else { applied }, Scheduled::Apply(number)));
            }
            if let Some(wire) = part.wire.filter(|wire| wire.delay > 0.0) {
                let arrived = (at + clock.delay + wire.delay) % period;
                let same = (period - arrived).min(arrived) < SAME * shortest;
                all.push((if same { 0.0 } else { arrived }, Scheduled::Arrive(number)));
            }
        }
        for (slow, (_, sensor)) in part.slow.iter().enumerate() {
            all.extend(samples(sensor.period).map(|at| (at, Scheduled::Read(number, slow))));
        }
    }
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut out: Vec<(f64, Vec<Scheduled>)> = Vec::new();
    for (at, what) in all {
        match out.last_mut() {
            Some((time, simultaneous)) if at - *time < SAME * shortest => simultaneous.push(what),
            _ => out.push((at, vec![what])),
        }
    }
    out.iter_mut().for_each(|(_, simultaneous)| simultaneous.sort_unstable());
    out
}

/// The common period of all clocks, s.
fn common_period(periods: &[f64], shortest: f64) -> Option<f64> {
    let longest = periods.iter().copied().fold(0.0, f64::max);
    let fits = |period: &f64| {
        periods.iter().all(|time| {
            let samples = period / time;
            (samples - samples.round()).abs() * time < SAME * shortest
        })
    };
    let samples = |period: &f64| periods.iter().map(|time| period / time).sum::<f64>();
    let all = (1..=MOST_SAMPLES).map(|k| k as f64 * longest);
    all.take_while(|period| samples(period) <= MOST_SAMPLES as f64 * 1.001).find(fits)
}
