//! The run of one variant: its signals, energy, events, outcome, requirements and figures.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use crate::signal_name::Quantity;

use super::Accuracy;
use super::motor_load::MotorLoad;
use super::physical::{DisplayUnit, Physical};

/// One time series.
#[derive(Debug, Clone, PartialEq)]
pub struct Signal {
    /// Modelica-style name: `rk.phi`, `wg_motor.tau`, `ref_rk`.
    pub name: String,
    /// Angle, speed, torque, charge, current, voltage.
    pub physical: Physical,
    /// One sentence for the reader of a table.
    pub description: String,
    /// One value for each entry of [`Series::time`], SI.
    pub values: Vec<f64>,
}

/// All signals of one run on one time grid. Values at the time of a step are those just after it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Series {
    /// Time in s, strictly increasing.
    pub time: Vec<f64>,
    /// The signals.
    pub signals: Vec<Signal>,
}

impl Series {
    /// The signal of that name.
    pub fn signal(&self, name: &str) -> Option<&Signal> {
        self.signals.iter().find(|signal| signal.name == name)
    }

    /// Largest torque command of a motor in the rows, before its limits, N m; `None` if there is no such motor.
    pub fn largest_torque_demand(&self, motor: &str) -> Option<f64> {
        let names = [Quantity::Command, Quantity::Torque, Quantity::Force, Quantity::Voltage]
            .map(|quantity| quantity.of(motor));
        let signal = names.iter().find_map(|name| self.signal(name));
        signal.map(|signal| signal.values.iter().fold(0.0, |max: f64, x| max.max(x.abs())))
    }
}

/// The energy balance of a run, J: `input = stored + dissipated + residual`.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Energy {
    /// Work done by all inputs and disturbances.
    pub input: f64,
    /// Change of kinetic and potential energy.
    pub stored: f64,
    /// Loss in dampers and friction.
    pub dissipated: f64,
    /// Error of the balance; its magnitude relative to `exchanged` certifies the run.
    pub residual: f64,
    /// Energy exchanged: the energy stored at the start, plus the magnitudes of the work of inputs in each step.
    pub exchanged: f64,
}

impl Energy {
    /// The residual relative to the energy exchanged; `None` if that is zero.
    pub fn residual_share(&self) -> Option<f64> {
        (self.exchanged > 0.0).then(|| (self.residual / self.exchanged).abs())
    }
}

/// An event at a located instant.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Event {
    /// Time in s.
    pub time: f64,
    /// `fs sticks`, `rk slips backward`, `ref_rk steps to 3.14159 rad`, `wg_motor reaches its torque limit`.
    pub description: String,
}

/// Whether a run reached its end with usable numbers.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Outcome {
    /// It did.
    #[default]
    Completed,
    /// It reached its end, but its energy balance does not close: its numbers are wrong from some time on.
    Unbalanced {
        /// The unexplained energy, and what to try.
        cause: String,
    },
    /// It stopped early; the results up to `time` are valid.
    Failed {
        /// Time reached, s.
        time: f64,
        /// The error, its reason, and what to try.
        cause: String,
    },
}

impl Outcome {
    /// Why its numbers are not those of a whole run; `None` if they are.
    pub fn cause(&self) -> Option<&str> {
        match self {
            Self::Completed => None,
            Self::Unbalanced { cause } | Self::Failed { cause, .. } => Some(cause),
        }
    }
}

/// The status of a run in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RunVerdict {
    /// It reached its end without warnings on its numbers.
    Completed,
    /// It reached its end with warnings on its numbers.
    Doubtful,
    /// It reached its end, but its energy balance does not close: its numbers are wrong from some time on.
    Unbalanced,
    /// It stopped early.
    Failed,
}

/// A parameter value of a variant.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterValue {
    /// Name in the model file.
    pub name: String,
    /// Value in SI.
    pub value: f64,
    /// SI unit.
    pub unit: String,
    /// Source text in the file: `10 deg`.
    pub text: String,
}

/// A requirement of the model file with its verdict.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct RequirementResult {
    /// As text: `max |driver.tau| from 1 s to 3 s < 0.01 N m`.
    pub text: String,
    /// The measured value, SI; `None` if the run ended before it could be measured.
    pub measured: Option<f64>,
    /// Its SI unit.
    pub unit: String,
    /// The unit of its bounds in the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Whether it is satisfied.
    pub passed: bool,
}

/// A figure of the model file: a number of a run.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FigureResult {
    /// Its name.
    pub name: String,
    /// Its description: `gain car.yaw_rate over wheel.phi at 0.2 Hz`.
    pub text: String,
    /// Its value, SI; `None` if the run has none.
    pub value: Option<f64>,
    /// Its SI unit.
    pub unit: String,
    /// The display unit of the file, if that differs.
    pub display: Option<DisplayUnit>,
}

/// Statistics of the integrator.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Effort {
    /// Accepted steps.
    pub steps: usize,
    /// Rejected steps.
    pub rejected: usize,
    /// Evaluations of the equations of motion.
    pub evaluations: usize,
    /// Located events.
    pub events: usize,
    /// The largest observed rounding error in a step, in tolerances: above 1, it does not shorten steps.
    pub rounding: f64,
    /// The integration method: it differs from the requested one if a loop has no series or derivatives.
    pub method: IntegrationMethod,
}

/// A method of integration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IntegrationMethod {
    /// The Runge-Kutta method of order 8 of Dormand and Prince.
    #[default]
    Dop853,
    /// Taylor series.
    Taylor,
    /// Radau IIA, an implicit method.
    Radau,
    /// Matrix exponentials, without an error of integration.
    Exponential,
}

impl fmt::Display for IntegrationMethod {
    /// Its word on the command line, in tables and in JSON.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// The run of one variant.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Run {
    /// `beta-10deg`; the model's name if there are no variants.
    pub name: String,
    /// The values that make this variant.
    pub parameters: Vec<ParameterValue>,
    /// The signals.
    pub series: Series,
    /// The energy balance up to the end (or the failure).
    pub energy: Energy,
    /// Events in order of time.
    pub events: Vec<Event>,
    /// Whether the run reached its end.
    pub outcome: Outcome,
    /// The model file's requirements.
    pub requirements: Vec<RequirementResult>,
    /// Its figures.
    pub figures: Vec<FigureResult>,
    /// Notes to the reader, such as a split between parallel friction elements that is not unique.
    pub notes: Vec<String>,
    /// Warnings on its numbers, such as an estimated error of a tenth of a signal or more.
    pub warnings: Vec<String>,
    /// The load of each motor with limits.
    pub motor_loads: Vec<MotorLoad>,
    /// Statistics of the integrator.
    pub effort: Effort,
    /// Its estimated error; `None` if not requested.
    pub accuracy: Option<Accuracy>,
}

impl Run {
    /// Its duration, s: to its end, or to the time where it stopped.
    pub fn length(&self) -> f64 {
        match self.outcome {
            Outcome::Failed { time, .. } => time,
            Outcome::Completed | Outcome::Unbalanced { .. } => self.series.time.last().copied().unwrap_or_default(),
        }
    }

    /// Its verdict.
    pub fn verdict(&self) -> RunVerdict {
        match self.outcome {
            Outcome::Failed { .. } => RunVerdict::Failed,
            Outcome::Unbalanced { .. } => RunVerdict::Unbalanced,
            Outcome::Completed if self.warnings.is_empty() => RunVerdict::Completed,
            Outcome::Completed => RunVerdict::Doubtful,
        }
    }
}
