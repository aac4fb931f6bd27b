//! A law with its wiring.

use std::ops::Range;
use std::sync::Arc;

use crate::program::Task;
use crate::reduce::{Kinematics, Reduced};
use crate::simulate::clocked::Clocked;
use crate::simulate::scenario::Scenario;
use crate::synthesis::{Law, LinearLaw, Running, Seen, Told};

/// A law with its wiring.
pub(super) struct Wired {
    pub law: Arc<dyn Law>,
    pub computer: Computer,
    pub inputs: Vec<usize>,
    /// Torque limits of its inputs, N m.
    pub limits: Vec<Option<f64>>,
    /// Sources that its commands are, of a task of blocks.
    pub answers: Vec<usize>,
    /// Sources that are what it tells blocks.
    pub told: Vec<(usize, Told)>,
    pub references: Vec<usize>,
    pub reference_values: Vec<f64>,
    pub commands: Vec<f64>,
    /// Torques that its inputs report.
    pub torques: Vec<f64>,
    /// Where its own states are; nowhere, if it has a clock.
    pub states: Range<usize>,
}

/// What computes a law in a run.
pub(super) enum Computer {
    /// At every instant, as part of the expressions of the loop.
    Linear(Box<LinearLaw>),
    /// At every instant, as expressions among those of the loop.
    Written(Arc<Task>),
    /// At every instant, by itself.
    Continuous(Running),
    Clocked(Box<Clocked>),
}

impl Wired {
    /// Whether it computes by itself at every instant.
    pub fn is_own(&self) -> bool {
        matches!(self.computer, Computer::Continuous(_))
    }

    pub fn clocked(&self) -> Option<&Clocked> {
        match &self.computer {
            Computer::Clocked(clocked) => Some(clocked),
            Computer::Linear(_) | Computer::Written(_) | Computer::Continuous(_) => None,
        }
    }

    pub fn clocked_mut(&mut self) -> Option<&mut Clocked> {
        match &mut self.computer {
            Computer::Clocked(clocked) => Some(clocked),
            Computer::Linear(_) | Computer::Written(_) | Computer::Continuous(_) => None,
        }
    }
}

/// What a law sees: the true angles and speeds, of disturbances nothing.
pub(super) fn seen<'a>(time: f64, kinematics: &'a Kinematics, references: &'a [f64], states: &'a [f64]) -> Seen<'a> {
    let Kinematics { angles, speeds, .. } = kinematics;
    Seen { time, angles, speeds, disturbances: &[], references, readings: &[], states }
}

/// What a machine is made of.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The plant.
    pub reduced: &'a Reduced,
    /// The laws, in any order; each input is commanded by one law or by the scenario.
    pub laws: &'a [Arc<dyn Law>],
    /// The scenario.
    pub scenario: &'a Scenario,
}
