//! A law in the loop of a run: one runner for all laws.

use kardan_rt::Health;

use super::Clock;
use kardan_math::num::StateArchive;

/// The running part of a law: code of `kardan-rt` with its numbers and its work space, for every instant or for a sample time.
pub trait Block: Send {
    /// Commands in N m. Returns whether they are finite; if not, the written values are invalid.
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool;
    /// The right side of its state equation, while its inputs apply these torques (N m): at every instant the rates of its states,
    /// 1/s; at a sample time the states at the next sample. Returns whether they are finite; if not, the written values are invalid.
    fn states(&mut self, _observation: Observation<'_>, _torques: &[f64], _out: &mut [f64]) -> bool {
        true
    }
    /// Its memory in addition to its states.
    fn archive_state(&mut self, _archive: &mut StateArchive<'_>) {}
    /// What went wrong at the last sample, and was dealt with in the block itself.
    fn health(&self) -> Health {
        Health::default()
    }
}

/// A designed law in the loop of a run. It has memory, and belongs to that run.
///
/// Where the block has no finite result, a law at every instant returns NaN: the step of the run shrinks, or the run
/// ends. A law with a clock repeats the commands and states of its last sample, and reports this in its [`health`](Self::health).
pub struct LawRuntime {
    block: Box<dyn Block>,
    clock: Option<Clock>,
    /// The last commands that were numbers.
    commands: Vec<f64>,
    commands_frozen: bool,
    states_frozen: bool,
}

impl LawRuntime {
    /// A block that commands so many inputs.
    pub fn new(block: Box<dyn Block>, clock: Option<Clock>, inputs: usize) -> Self {
        Self { block, clock, commands: vec![0.0; inputs], commands_frozen: false, states_frozen: false }
    }

    /// When it runs; `None`: at every instant.
    pub fn clock(&self) -> Option<Clock> {
        self.clock
    }

    /// Commands in N m.
    pub fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) {
        self.commands_frozen = !self.block.command(observation, out);
        match (self.commands_frozen, self.clock) {
            (false, None) => {}
            (false, Some(_)) => self.commands.copy_from_slice(out),
            (true, None) => out.fill(f64::NAN),
            (true, Some(_)) => out.copy_from_slice(&self.commands),
        }
    }

    /// Rates of the states of a law without a clock, 1/s, while its inputs apply these torques (N m).
    pub fn rates(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) {
        debug_assert!(self.clock.is_none(), "a law with a clock has no rates");
        if !self.block.states(observation, torques, out) {
            out.fill(f64::NAN);
        }
    }

    /// The states of a law with a clock at the next sample, if its inputs apply these torques (N m) in between.
    pub fn next(&mut self, observation: Observation<'_>, torques: &[f64], out: &mut [f64]) {
        debug_assert!(self.clock.is_some(), "a law without a clock has no next sample");
        self.states_frozen = !self.block.states(observation, torques, out);
        if self.states_frozen {
            out.copy_from_slice(observation.states);
        }
    }

    /// Its whole memory in addition to the states.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.commands);
        archive.flag(&mut self.commands_frozen);
        archive.flag(&mut self.states_frozen);
        self.block.archive_state(archive);
    }

    /// What went wrong at the last sample, and was dealt with.
    pub fn health(&self) -> Health {
        let health = self.block.health();
        let frozen = if self.commands_frozen { self.commands.len() } else { 0 };
        Health {
            commands_bounded: health.commands_bounded + frozen,
            estimate_frozen: health.estimate_frozen || self.states_frozen,
            ..health
        }
    }
}

/// The observation of a law at one instant.
#[derive(Debug, Clone, Copy, Default)]
pub struct Observation<'a> {
    /// The time, s.
    pub time: f64,
    /// Angles of all shafts, sorted by name, rad.
    pub angles: &'a [f64],
    /// Their speeds, rad/s.
    pub speeds: &'a [f64],
    /// Disturbance torques on the shafts of [`Request::disturbances`](super::Request::disturbances), N m.
    pub disturbances: &'a [f64],
    /// The references of the scenario, in the order of [`Law::references`](super::Law::references).
    pub references: &'a [f64],
    /// What its sensors read, in the order of [`Law::sensors`](super::Law::sensors); empty in continuous time, where sensors are ideal.
    pub readings: &'a [f64],
    /// Its own states.
    pub states: &'a [f64],
}

#[cfg(test)]
#[path = "../tests/unit/law_runtime.rs"]
mod tests;
