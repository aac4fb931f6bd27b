//! A run from outside: compiled, then run through its scenario.

use super::RunLoop;
use super::recording::RunResult;
use super::tolerance::Tolerance;
use crate::counts::FlippedReading;
use crate::{Machine, Setup};
use kardan_math::num::Random;
use kardan_results::{Outcome, Run};

/// The most rows that ends of steps add.
const MOST_ADDED: usize = 20_000;

/// Runs a closed loop through its scenario.
///
/// Between events the modes are fixed and the equations smooth: they are integrated by the [`Method`](super::Method) and with the
/// tolerance given. Steps and ramps of the scenario end steps exactly. Reversals of slipping directions, breakaway of sticking ones and
/// limits of motors are located on the dense output to the last bits of the time.
///
/// `progress` receives the completed fraction, and returns a reason if the run is to end there. Never fails as a whole:
/// a run that cannot continue ends with [`Outcome::Failed`] and all results so far.
pub fn simulate(setup: Setup<'_>, tolerance: Tolerance, progress: &mut dyn FnMut(f64) -> Option<String>) -> Run {
    Ready::new(setup, tolerance).run(progress).run
}

/// Elements with gears that the inertia of their load would lock at the start (Painlevé).
pub fn locking_gears(setup: Setup<'_>) -> Vec<String> {
    let (reduced, scenario) = (setup.reduced, setup.scenario);
    let mut machine = Machine::new(setup);
    let mut state = vec![0.0; machine.size()];
    machine.start(&reduced.state(&scenario.position, &scenario.speed), &mut state);
    machine.enter_segment(0.0);
    machine.self_locking_gears(&state).into_iter().map(|direction| machine.names[direction].clone()).collect()
}

/// A run that is compiled and has not started.
pub struct Ready(RunLoop);

impl Ready {
    /// Compiles the expressions of a loop.
    pub fn new(setup: Setup<'_>, tolerance: Tolerance) -> Self {
        Self(RunLoop::new(setup, tolerance))
    }

    /// Records the readings of counting sensors for sampled laws.
    pub fn noting(self) -> Self {
        self.turning(&[])
    }

    /// The same, with some readings flipped; the readings of a sensor in their order.
    pub fn turning(mut self, flipped: &[FlippedReading]) -> Self {
        self.0.machine.note_counts(flipped);
        self
    }

    /// Perturbs rounding: where sampled laws end the steps, moving coordinates are changed by up to two units in their
    /// last place. So its rounding errors differ from those of the run that it is compared with.
    pub fn shaken(mut self) -> Self {
        self.0.shaken = Some(Random::new(0));
        self
    }

    /// Adds a row at the end of each step that has none, so that rows show what happens between those of the scenario: where steps are shorter than
    /// the distance of rows.
    pub fn between_rows(mut self) -> Self {
        self.0.added_rows = MOST_ADDED;
        self
    }

    /// Runs it; see [`simulate`].
    pub fn run(self, progress: &mut dyn FnMut(f64) -> Option<String>) -> RunResult {
        let mut run_loop = self.0;
        let duration = run_loop.scenario.duration;
        let outcome = match run_loop.proceed(duration, progress).and_then(|()| run_loop.sample_at_end()) {
            Ok(()) => {
                // The last row, at the end itself.
                run_loop.observe_until(f64::INFINITY, Some(duration));
                Outcome::Completed
            }
            Err(outcome) => outcome,
        };
        run_loop.finish(outcome)
    }
}
