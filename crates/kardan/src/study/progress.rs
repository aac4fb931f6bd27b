//! How far a long command is, what is kept of it, and how it is ended.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::results::{Analysis, Design, Identification, Safety, Study};
use crate::simulate::{Ready, RunResult, Setup, Tolerance};

/// Hears how far the runs are, and may end them. Called from several threads.
pub trait Progress: Sync {
    /// The fraction done of a variant, from 0 to 1.
    fn advance(&self, variant: usize, name: &str, fraction: f64);

    /// Of many runs so many are done; those count too that were there before.
    fn counted(&self, done: usize, all: usize) {
        self.advance(0, "runs", (done as f64 / all as f64).min(1.0));
    }

    /// The part done of what comes before: reading, checks, and the design of the laws, from 0 to 1.
    fn preparing(&self, _fraction: f64) {}

    /// Something worth to be said while it runs, which is no part of what is found.
    fn message(&self, _text: &str) {}

    /// Why everything is to end now; `None`: it goes on. Asked often by all that takes long and keeps what it has: runs end
    /// with [`Outcome::Failed`](crate::results::Outcome::Failed) and this cause, trials of a design are left out and say so.
    fn stop(&self) -> Option<String> {
        None
    }

    /// Something is finished that is worth to be shown should nothing more come; it takes the place of what was kept before. Told
    /// between parts that cannot be ended in their middle, such as proofs and eigenvalues. `part` makes a copy.
    fn store_partial(&self, _part: &dyn Fn() -> Part) {}

    /// What was kept is not needed any more: all is done.
    fn release(&self) {}

    /// Steps of the integrator that one run may take.
    fn most_steps(&self) -> usize {
        Tolerance::default().most_steps
    }
}

/// What is finished of a command; what it has not come to is named in it (`unfinished`, of a study in its warnings).
#[derive(Debug, Clone)]
pub enum Part {
    /// Of [`run`](super::run): all runs.
    Study(Arc<Study>),
    /// Of [`analyze`](super::analyze()) and [`analyze_state_space`](super::analyze_state_space).
    Analysis(Box<Analysis>),
    /// Of [`design`](super::design()).
    Design(Box<Design>),
    /// Of [`safety`](super::safety()).
    Safety(Box<Safety>),
    /// Of [`identify`](super::identify).
    Identification(Box<Identification>),
}

/// Hears nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: usize, _: &str, _: f64) {}
}

/// Counts the runs of many that are done, and hands on what a run asks.
pub(super) struct Counted<'p> {
    progress: &'p dyn Progress,
    done: AtomicUsize,
    all: usize,
    /// Whether none of them is ended in its middle.
    whole: bool,
}

impl<'p> Counted<'p> {
    /// With those that are done already.
    pub fn new(progress: &'p dyn Progress, done: usize, all: usize) -> Self {
        Self { progress, done: AtomicUsize::new(done), all, whole: false }
    }

    /// The same for runs that come to their end, whatever is asked meanwhile.
    pub fn of_whole_runs(self) -> Self {
        Self { whole: true, ..self }
    }

    /// So many more are done.
    pub fn count(&self, runs: usize) {
        let done = self.done.fetch_add(runs, Ordering::Relaxed) + runs;
        self.progress.counted(done, self.all);
    }
}

impl Progress for Counted<'_> {
    fn advance(&self, _: usize, _: &str, _: f64) {}

    fn stop(&self) -> Option<String> {
        if self.whole { None } else { self.progress.stop() }
    }

    fn most_steps(&self) -> usize {
        self.progress.most_steps()
    }
}

/// Simulates, heard as the variant of that number and name, and ended, through `progress`.
pub(super) fn simulate_with_progress(
    setup: Setup<'_>,
    tolerance: Tolerance,
    (number, name): (usize, &str),
    progress: &dyn Progress,
) -> RunResult {
    run_with_progress(Ready::new(setup, tolerance), (number, name), progress)
}

/// The same of a run that is compiled.
pub(super) fn run_with_progress(ready: Ready, (number, name): (usize, &str), progress: &dyn Progress) -> RunResult {
    progress.advance(number, name, 0.0);
    let result = ready.run(&mut |part| {
        progress.advance(number, name, part);
        progress.stop()
    });
    progress.advance(number, name, 1.0);
    result
}
