//! Inputs of a run: steps and ramps of the external signals.

use std::sync::Arc;

use super::Faults;
use kardan_expr::expr::OfTime;
use kardan_math::names::HasName;
use kardan_math::num::StateArchive;
use kardan_mechanics::program::Task;
use kardan_results::Physical;

/// The target of a signal of the scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SourceTarget {
    /// A law reads it.
    Reference,
    /// It is a torque on that input (a disturbance, or the command of a motor without a law).
    Input(usize),
    /// A block outputs it, or computes it from the time: no other source sets it.
    Block,
}

/// A signal set by the scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    /// Name.
    pub name: String,
    /// Angle or torque.
    pub physical: Physical,
    /// One sentence.
    pub description: String,
    /// Where it goes.
    pub target: SourceTarget,
}

impl HasName for Source {
    fn name(&self) -> &str {
        &self.name
    }
}

/// A step or ramp of one signal.
#[derive(Debug, Clone, PartialEq)]
pub struct SignalEvent {
    /// Number of the source.
    pub source: usize,
    /// Start, s.
    pub at: f64,
    /// Final value, SI.
    pub to: f64,
    /// Length of the ramp, s; 0: a step.
    pub over: f64,
}

/// Further terms of a source besides its steps and ramps.
#[derive(Debug, Clone, PartialEq)]
pub struct SourceSignal {
    /// Number of the source.
    pub source: usize,
    /// The addend, SI.
    pub function: OfTime,
}

/// Signals of a run that are recorded, others are not.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Their names; names without a signal have no effect.
    pub names: Vec<String>,
    /// Whether they must have the same bits as in a run that records all signals: angles and speeds alone may follow
    /// from their series, with different last bits.
    pub as_all: bool,
}

/// A scenario for one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scenario {
    /// Length, s.
    pub duration: f64,
    /// Output times, s, strictly increasing from 0 to the duration.
    pub times: Vec<f64>,
    /// Signals from outside.
    pub sources: Vec<Source>,
    /// Their steps and ramps.
    pub events: Vec<SignalEvent>,
    /// Functions of time that are added, at most one for each source.
    pub signals: Vec<SourceSignal>,
    /// Blocks that compute at samples, the shortest sample time first.
    pub tasks: Vec<Arc<Task>>,
    /// Blocks without a sample time, which compute at every instant.
    pub flow: Option<Arc<Task>>,
    /// Sensors of signals for linearisation: each holds its signal at its samples (zero-order hold).
    pub sensors: Vec<Arc<Task>>,
    /// The faults.
    pub faults: Faults,
    /// Seed of the noise of sensors.
    pub seed: u64,
    /// The signals to record; `None`: all.
    pub recorded: Option<Recorded>,
    /// Initial reduced coordinates, rad.
    pub position: Vec<f64>,
    /// Initial reduced speeds, rad/s.
    pub speed: Vec<f64>,
}

impl Scenario {
    /// The number of the source of a name.
    pub(super) fn source(&self, name: &str) -> Option<usize> {
        self.sources.iter().position(|source| source.name == name)
    }
}

/// A signal over time: straight lines between breakpoints, with jumps at them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Profile {
    /// `(value, slope, start)` of each line, sorted by start; the value is 0 before the first.
    pieces: Vec<(f64, f64, f64)>,
}

impl Profile {
    /// The profile of one source under a list of events. An event that starts during a ramp takes over from the value
    /// reached.
    ///
    /// ```
    /// use kardan_simulate::{Profile, SignalEvent};
    /// let ramp = [SignalEvent { source: 0, at: 1.0, to: 4.0, over: 2.0 }];
    /// assert_eq!(Profile::new(ramp.iter()).value(2.0), 2.0);
    /// ```
    pub fn new<'a>(events: impl Iterator<Item = &'a SignalEvent>) -> Self {
        let mut sorted: Vec<&SignalEvent> = events.collect();
        sorted.sort_by(|a, b| a.at.total_cmp(&b.at));
        let mut out = Self::default();
        for event in sorted {
            let from = out.value(event.at);
            out.pieces.retain(|(.., start)| *start < event.at);
            if event.over > 0.0 {
                out.pieces.push((from, (event.to - from) / event.over, event.at));
            }
            out.pieces.push((event.to, 0.0, event.at + event.over.max(0.0)));
        }
        out
    }

    /// Has one value from a time on, and none before it.
    pub(super) fn set_constant(&mut self, from: f64, value: f64) {
        self.pieces.clear();
        self.pieces.push((value, 0.0, from));
    }

    /// Its pieces, which may have been set from outside.
    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.list(&mut self.pieces, (0.0, 0.0, 0.0), |archive, (value, slope, start)| {
            [start, value, slope].into_iter().for_each(|x| archive.number(x));
        });
    }

    /// The value at a time; at a jump, the value after it.
    pub fn value(&self, time: f64) -> f64 {
        let (value, slope, start) = self.piece(time);
        value + slope * (time - start)
    }

    /// `(value, slope, start)` of the line that is valid from a time on.
    pub fn piece(&self, time: f64) -> (f64, f64, f64) {
        self.pieces.iter().rev().find(|(.., start)| *start <= time).copied().unwrap_or_default()
    }

    /// Whether it only steps.
    pub(super) fn is_level(&self) -> bool {
        self.pieces.iter().all(|(_, slope, _)| *slope == 0.0)
    }

    /// Times where the line changes, s.
    pub fn breakpoints(&self) -> impl Iterator<Item = f64> {
        self.pieces.iter().map(|(.., start)| *start)
    }
}

#[cfg(test)]
#[path = "../tests/unit/scenario.rs"]
mod tests;
