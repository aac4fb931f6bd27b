//! A law with its interconnection.

use std::ops::Range;
use std::sync::Arc;

use crate::sampled_runtime::SampledRuntime;
use crate::scenario::Scenario;
use kardan_mechanics::program::Task;
use kardan_mechanics::reduce::{Kinematics, Reduced};
use kardan_synthesis::{ExportedSignal, Law, LawRuntime, LinearLaw, Observation};

/// A law with its interconnection.
pub(super) struct ConnectedLaw {
    pub law: Arc<dyn Law>,
    pub computer: Computer,
    pub inputs: Vec<usize>,
    /// Torque limits of its inputs, N m.
    pub limits: Vec<Option<f64>>,
    /// Sources that its commands are, of a task of blocks.
    pub outputs: Vec<usize>,
    /// Sources that are the law's signals for blocks.
    pub exported: Vec<(usize, ExportedSignal)>,
    pub references: Vec<usize>,
    pub reference_values: Vec<f64>,
    pub commands: Vec<f64>,
    /// Reported torques of its inputs.
    pub torques: Vec<f64>,
    /// Indices of its own states; none, if it has a clock.
    pub states: Range<usize>,
}

/// The computer of a law in a run.
pub(super) enum Computer {
    /// At every instant, as part of the expressions of the loop.
    Linear(Box<LinearLaw>),
    /// At every instant, as expressions among those of the loop.
    Inlined(Arc<Task>),
    /// At every instant, by its own code.
    Continuous(LawRuntime),
    SampledRuntime(Box<SampledRuntime>),
}

impl ConnectedLaw {
    /// Whether its own code computes at every instant.
    pub fn is_own(&self) -> bool {
        matches!(self.computer, Computer::Continuous(_))
    }

    pub fn sampled_runtime(&self) -> Option<&SampledRuntime> {
        match &self.computer {
            Computer::SampledRuntime(sampled_runtime) => Some(sampled_runtime),
            Computer::Linear(_) | Computer::Inlined(_) | Computer::Continuous(_) => None,
        }
    }
}

/// The inputs of a law: the true angles and speeds, no disturbances.
pub(super) fn observation<'a>(
    time: f64,
    kinematics: &'a Kinematics,
    references: &'a [f64],
    states: &'a [f64],
) -> Observation<'a> {
    let Kinematics { angles, speeds, .. } = kinematics;
    Observation { time, angles, speeds, disturbances: &[], references, readings: &[], states }
}

/// The parts of a machine.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The plant.
    pub reduced: &'a Reduced,
    /// The laws, in any order; each input is commanded by one law or by the scenario.
    pub laws: &'a [Arc<dyn Law>],
    /// The scenario.
    pub scenario: &'a Scenario,
}
