//! Progress of a long command, its partial results, and its termination.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use kardan_results::{Analysis, Design, Identification, Safety, Study};
use kardan_simulate::{Ready, RunResult, Tolerance};

/// Receives progress of runs, and may end them. Called from several threads.
pub trait Progress: Sync {
    /// The fraction done of a variant, from 0 to 1.
    fn advance(&self, variant: usize, name: &str, fraction: f64);

    /// The number of finished runs of many; runs that existed before count too.
    fn counted(&self, done: usize, all: usize) {
        self.advance(0, "runs", (done as f64 / all as f64).min(1.0));
    }

    /// The finished fraction of the preparation: reading, checks, and the design of the laws, from 0 to 1.
    fn preparing(&self, _fraction: f64) {}

    /// A message during the run that is not part of the results.
    fn message(&self, _text: &str) {}

    /// Why everything must end now; `None`: it continues. Called often by everything that takes long and has partial results: runs end
    /// with [`Outcome::Failed`](kardan_results::Outcome::Failed) and this cause, trials of a design are left out and reported as such.
    fn stop(&self) -> Option<String> {
        None
    }

    /// Stores a partial result to show if nothing more follows; it replaces the previous one. Called
    /// between parts that cannot be interrupted, such as proofs and eigenvalues. `part` makes a copy.
    fn store_partial(&self, _part: &dyn Fn() -> Part) {}

    /// Releases the partial result: everything is done.
    fn release(&self) {}

    /// Steps of the integrator that one run may take.
    fn most_steps(&self) -> usize {
        Tolerance::default().most_steps
    }
}

/// The partial result of a command; it names its missing results (`unfinished`, of a study in its warnings).
#[derive(Debug, Clone)]
pub enum Part {
    /// Of [`run`](crate::study::run): all runs.
    Study(Arc<Study>),
    /// Of [`analyze`](crate::study::analyze()) and [`analyze_state_space`](crate::study::analyze_state_space).
    Analysis(Box<Analysis>),
    /// Of [`design`](crate::study::design()).
    Design(Box<Design>),
    /// Of [`Project::safety`](crate::study::Project::safety).
    Safety(Box<Safety>),
    /// Of [`identify`](crate::study::identify).
    Identification(Box<Identification>),
}

/// Ignores progress.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn advance(&self, _: usize, _: &str, _: f64) {}
}

/// Counts the finished runs of many, and forwards queries of a run.
pub(in crate::study) struct Counted<'p> {
    progress: &'p dyn Progress,
    done: AtomicUsize,
    all: usize,
    /// Whether no run was interrupted.
    whole: bool,
}

impl<'p> Counted<'p> {
    /// Starts with this number of finished runs.
    pub fn new(progress: &'p dyn Progress, done: usize, all: usize) -> Self {
        Self { progress, done: AtomicUsize::new(done), all, whole: false }
    }

    /// The same for runs that must finish, even if a stop is requested meanwhile.
    pub fn of_whole_runs(self) -> Self {
        Self { whole: true, ..self }
    }

    /// Adds this number of finished runs.
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

/// Simulates; reports progress as the variant of that number and name, and stops on request, through `progress`.
pub(in crate::study) fn run_with_progress(
    ready: Ready,
    (number, name): (usize, &str),
    progress: &dyn Progress,
) -> RunResult {
    progress.advance(number, name, 0.0);
    let result = ready.run(&mut |part| {
        progress.advance(number, name, part);
        progress.stop()
    });
    progress.advance(number, name, 1.0);
    result
}
