//! A designed law.

use std::sync::Arc;

use super::{Block, Clock, ExactLoop, LawRuntime, LinearLaw, Reference};
use kardan_analysis::OutputSignal;
use kardan_expr::expr::Side;
use kardan_math::num::Rational;
use kardan_mechanics::program::Task;
use kardan_results::Design;

/// For each of some expressions the guards at which it has kinks, and those at which it jumps.
pub type Kinks = Vec<[Vec<String>; 2]>;

/// Prefix of the names of states that are estimates.
const ESTIMATE: &str = "estimate of ";

/// A designed law. It measures angles and speeds of shafts and commands inputs; it has no state of any run.
pub trait Law: Send + Sync {
    /// Names of the inputs that it commands, in the order of `out` of [`Block::command`].
    fn inputs(&self) -> &[String];
    /// The signals that the scenario sets for it.
    fn references(&self) -> &[Reference];
    /// Their values at its equilibrium.
    fn references_at_rest(&self) -> Vec<f64> {
        vec![0.0; self.references().len()]
    }
    /// Names of its own states: estimates of an observer, integrators, filters.
    fn states(&self) -> Vec<String> {
        Vec::new()
    }
    /// The estimates of its observer, for blocks to read: names without that of the law (`rk.disturbance`, `fs.w`), and which of its states each
    /// is, as predicted for its next sample.
    fn estimates(&self) -> Vec<(String, usize)> {
        let estimate = |(k, name): (usize, String)| Some((name.strip_prefix(ESTIMATE)?.to_string(), k));
        self.states().into_iter().enumerate().filter_map(estimate).collect()
    }
    /// All that blocks may read of a law at its samples, by names without its own: the estimates of its observer, and its last commands.
    fn exported(&self) -> Vec<(String, ExportedSignal)> {
        let commands = self.inputs().iter().enumerate();
        let commands = commands.map(|(k, input)| (format!("{input}.command"), ExportedSignal::Command(k)));
        self.estimates().into_iter().map(|(name, k)| (name, ExportedSignal::State(k))).chain(commands).collect()
    }
    /// Its own states at the start, from the angles (rad) and speeds (rad/s) of all shafts there.
    fn start(&self, _angles: &[f64], _speeds: &[f64], out: &mut [f64]) {
        out.fill(0.0);
    }
    /// Its running part: at every instant, or at the samples of a clock. `None` if a number overflows there, or the law is for
    /// another sample time.
    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>>;
    /// The running part in a loop.
    fn run(&self) -> LawRuntime {
        let Some(block) = self.block(self.clock()) else {
            unreachable!("a law is designed for its own clock");
        };
        LawRuntime::new(block, self.clock(), self.inputs().len())
    }
    /// Whether it cancels all forces of the full model, which the linear one does not know.
    fn on_full_model(&self) -> bool {
        false
    }
    /// The speed (rad/s) over which the Coulomb friction that it feeds forward is smoothed, if it does.
    fn friction_width(&self) -> Option<f64> {
        None
    }
    /// The linear part: of a nonlinear law that at the design point, of a law with a clock that between its samples.
    fn linear(&self) -> LinearLaw;
    /// The linear part at a sample time, `ξ⁺ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ`, `u = C ξ + …`, with the torques τ commanded, within
    /// the motors' torque limits, on average until the next sample; lag and rate limit are not in it. `None` if a number overflows
    /// there, or the law is for another sample time.
    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw>;
    /// The linear part at every instant before its numbers are rounded, where that is known.
    fn linear_exact(&self) -> Option<Arc<LinearLaw<Rational>>> {
        None
    }
    /// By how much rounding may have moved the numbers of its linear part where that is more than their last digits, as of slopes whose terms cancel.
    fn linear_rounding(&self) -> Option<Arc<LinearLaw>> {
        None
    }
    /// Whether its linear part is another one at another position.
    fn is_nonlinear(&self) -> bool {
        false
    }
    /// The linear part at rest at a reduced position (rad), each position reference being where its output is; with a clock that
    /// between samples, in double precision. `None` if a number overflows.
    fn linear_at(&self, _position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        match clock {
            Some(clock) => self.linear_sampled(clock),
            None => Some(self.linear()),
        }
    }
    /// For each command, then for each state, its kinks and its jumps at the design point.
    fn kinks(&self) -> Kinks {
        Kinks::new()
    }
    /// The same law, linearised on one side of its kinks; `None`: it is the same on all sides.
    fn on_side(&self, _side: &Side) -> Option<Arc<dyn Law>> {
        None
    }
    /// The signals that it measures, if it does not see the true angles and speeds.
    fn sensors(&self) -> &[OutputSignal] {
        &[]
    }
    /// The task whose outputs its commands are at every instant, where its expressions can be part of those of the loop.
    fn task(&self) -> Option<&Arc<Task>> {
        None
    }
    /// When it runs; `None`: at every instant.
    fn clock(&self) -> Option<Clock> {
        None
    }
    /// The designed linear loop, where the design is exact.
    fn exact(&self) -> Option<ExactLoop> {
        None
    }
    /// What stays as it was where a sample makes it no number.
    fn keeps(&self) -> Frozen {
        Frozen::Estimate
    }
    /// The design as a result: all that is known without the other controllers and without a run.
    fn describe(&self) -> Design;
}

impl std::fmt::Debug for dyn Law {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "the law of {}", self.describe().controller)
    }
}

/// Location of a signal that a sampled law exports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum ExportedSignal {
    /// Among its states, as they are at its next sample.
    State(usize),
    /// Among its commands, as it gave them at its last sample.
    Command(usize),
}

/// What stays as it was where a sample makes it no number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Frozen {
    /// An estimate.
    Estimate,
    /// A command of a program, or a state of its blocks.
    Command,
    /// An output or a state of blocks.
    Outputs,
}
