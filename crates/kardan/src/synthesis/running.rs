//! A law in the loop of a run: one runner for all laws.

use kardan_rt::Health;

use super::Clock;
use crate::num::Keeper;

/// What of a law computes: code of `kardan-rt` with its numbers and its work space, made for every instant or for a sample time.
pub trait Block: Send {
    /// Commands in N m. Returns whether it has finite ones; if not, what it has written is of no use.
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) -> bool;
    /// The right side of its state equation, while its inputs apply these torques (N m): at every instant the rates of its states,
    /// 1/s; at a sample time the states at the next sample. Returns whether it is finite; if not, what it has written is of no use.
    fn states(&mut self, _seen: Seen<'_>, _torques: &[f64], _out: &mut [f64]) -> bool {
        true
    }
    /// What it remembers besides its states.
    fn keep(&mut self, _keeper: &mut Keeper<'_>) {}
    /// What went wrong at the last sample, and was dealt with in the block itself.
    fn health(&self) -> Health {
        Health::default()
    }
}

/// A designed law in the loop of a run. It has memory, and belongs to that run.
///
/// Where the block has no finite answer, a law at every instant gives what is no number: the step of the run shrinks, or the run
/// ends. A law with a clock commands and remembers what it did at the sample before, and says so in its [`health`](Self::health).
pub struct Running {
    block: Box<dyn Block>,
    clock: Option<Clock>,
    /// The last commands that were numbers.
    commands: Vec<f64>,
    commands_kept: bool,
    states_kept: bool,
}

impl Running {
    /// A block that commands so many inputs.
    pub fn new(block: Box<dyn Block>, clock: Option<Clock>, inputs: usize) -> Self {
        Self { block, clock, commands: vec![0.0; inputs], commands_kept: false, states_kept: false }
    }

    /// When it runs; `None`: at every instant.
    pub fn clock(&self) -> Option<Clock> {
        self.clock
    }

    /// Commands in N m.
    pub fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        self.commands_kept = !self.block.command(seen, out);
        match (self.commands_kept, self.clock) {
            (false, None) => {}
            (false, Some(_)) => self.commands.copy_from_slice(out),
            (true, None) => out.fill(f64::NAN),
            (true, Some(_)) => out.copy_from_slice(&self.commands),
        }
    }

    /// Rates of the states of a law without a clock, 1/s, while its inputs apply these torques (N m).
    pub fn rates(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        debug_assert!(self.clock.is_none(), "a law with a clock has no rates");
        if !self.block.states(seen, torques, out) {
            out.fill(f64::NAN);
        }
    }

    /// The states of a law with a clock at the next sample, if its inputs apply these torques (N m) in between.
    pub fn next(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        debug_assert!(self.clock.is_some(), "a law without a clock has no next sample");
        self.states_kept = !self.block.states(seen, torques, out);
        if self.states_kept {
            out.copy_from_slice(seen.states);
        }
    }

    /// All that it remembers besides the states.
    pub fn keep(&mut self, keeper: &mut Keeper<'_>) {
        keeper.numbers(&mut self.commands);
        keeper.flag(&mut self.commands_kept);
        keeper.flag(&mut self.states_kept);
        self.block.keep(keeper);
    }

    /// What went wrong at the last sample, and was dealt with.
    pub fn health(&self) -> Health {
        let health = self.block.health();
        let kept = if self.commands_kept { self.commands.len() } else { 0 };
        Health {
            commands_bounded: health.commands_bounded + kept,
            estimate_kept: health.estimate_kept || self.states_kept,
            ..health
        }
    }
}

/// What a law sees at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// The time, s.
    pub time: f64,
    /// Angles of all shafts, sorted by name, rad.
    pub angles: &'a [f64],
    /// Their speeds, rad/s.
    pub speeds: &'a [f64],
    /// Disturbance torques on the shafts of [`Request::disturbances`](super::Request::disturbances), N m.
    pub disturbances: &'a [f64],
    /// What the scenario tells it, in the order of [`Law::references`](super::Law::references).
    pub references: &'a [f64],
    /// What its sensors read, in the order of [`Law::sensors`](super::Law::sensors); in continuous time nothing, and sensors are ideal.
    pub readings: &'a [f64],
    /// Its own states.
    pub states: &'a [f64],
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the reference; no answer where that is no number.
    struct Twice;

    impl Block for Twice {
        fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) -> bool {
            out[0] = 2.0 * seen.references[0];
            out[0].is_finite()
        }

        fn states(&mut self, seen: Seen<'_>, _: &[f64], out: &mut [f64]) -> bool {
            self.command(seen, out)
        }
    }

    fn seen<'a>(reference: &'a [f64], states: &'a [f64]) -> Seen<'a> {
        Seen { time: 0.0, angles: &[], speeds: &[], disturbances: &[], references: reference, readings: &[], states }
    }

    #[test]
    fn without_an_answer_a_clock_holds_and_no_clock_says_so() {
        let clock = Clock { period: 1e-3, delay: 0.0, single: false };
        let (mut sampled, mut continuous) =
            (Running::new(Box::new(Twice), Some(clock), 1), Running::new(Box::new(Twice), None, 1));
        let (mut command, mut state) = ([0.0], [0.0]);
        for (reference, held, expected) in [(1.5, false, 3.0), (f64::NAN, true, 3.0), (-2.0, false, -4.0)] {
            sampled.command(seen(&[reference], &[7.0]), &mut command);
            sampled.next(seen(&[reference], &[7.0]), &[], &mut state);
            assert_eq!((command[0], state[0]), (expected, if held { 7.0 } else { expected }));
            let health = sampled.health();
            assert_eq!((health.commands_bounded, health.estimate_kept), (usize::from(held), held));
            continuous.command(seen(&[reference], &[7.0]), &mut command);
            continuous.rates(seen(&[reference], &[7.0]), &[], &mut state);
            assert_eq!([command[0], state[0]].map(f64::is_nan), [held; 2]);
            assert!(held || command == state && command[0] == 2.0 * reference);
        }
    }

    #[test]
    fn what_it_held_is_part_of_a_snapshot() {
        let clock = Clock { period: 1e-3, delay: 0.0, single: false };
        let mut one = Running::new(Box::new(Twice), Some(clock), 1);
        one.command(seen(&[4.0], &[]), &mut [0.0]);
        let mut keeper = Keeper::taking();
        one.keep(&mut keeper);
        let words = keeper.words();
        let mut other = Running::new(Box::new(Twice), Some(clock), 1);
        let mut keeper = Keeper::putting(&words);
        other.keep(&mut keeper);
        assert!(keeper.fits());
        let mut command = [0.0];
        other.command(seen(&[f64::NAN], &[]), &mut command);
        assert_eq!(command, [8.0]);
    }
}
