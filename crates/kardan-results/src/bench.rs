//! Results: the plant of a virtual test bench and its runs.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

use super::design::numbers;
use super::{DataNumber, Design, Identification, Physical, Run};

/// A value of the plant on a virtual bench.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TrueValue {
    /// `wg.damping`, or the name of a parameter.
    pub name: String,
    /// SI.
    pub value: f64,
    /// SI unit; empty for a plain number.
    pub unit: String,
    /// The value of the model; `None` if it has no such value.
    pub nominal: Option<f64>,
}

/// A part of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BenchPoint {
    /// When its measurement begins, s.
    pub from: f64,
    /// When it ends, s.
    pub until: f64,
    /// Speed of each shaft by its name, rad/s; the largest magnitudes in a section of sines or steps.
    #[serde(serialize_with = "numbers")]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub speeds: Vec<DataNumber>,
    /// Torque of each motor by its name that the model predicts, N m; the largest magnitudes in a section.
    #[serde(serialize_with = "numbers")]
    #[schemars(with = "BTreeMap<String, f64>")]
    pub torques: Vec<DataNumber>,
}

/// The expected accuracy of one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PlannedParameter {
    /// `wg.damping`
    pub name: String,
    /// Value of the model, SI.
    pub nominal: f64,
    /// SI unit.
    pub unit: String,
    /// Expected standard error from white noise of the logged torques alone; `None` if none is stated.
    pub standard_error: Option<f64>,
}

/// An excitation designed to identify parameters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BenchPlan {
    /// `constant_speeds`, `multisine` or `random_steps`.
    pub kind: String,
    /// The parameters to identify.
    pub parameters: Vec<PlannedParameter>,
    /// Coefficients that this kind of motion, or the selection of the file, does not identify.
    #[serde(rename = "fixed_coefficients")]
    pub fixed: Vec<String>,
    /// The selected parts, in the order of the log.
    pub points: Vec<BenchPoint>,
    /// Candidates within the limits.
    pub candidates: usize,
    /// `ln det(XᵀX)` of the selected parts.
    pub log_det: f64,
    /// The same of all candidates, for the number of selected parts.
    #[serde(rename = "baseline_log_det")]
    pub undesigned_log_det: f64,
    // `exp((log det − undesigned)/parameters)`
    /// Number of parts of the plan with as much information as one of the undesigned plan.
    pub gain: f64,
    /// Length, s.
    pub duration: f64,
}

/// The result of a virtual bench.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Name of the model.
    pub model: String,
    /// True values of the plant that the model does not contain.
    pub truth: Vec<TrueValue>,
    /// The excitation; `None` if the controllers and the scenario of the file ran.
    pub plan: Option<BenchPlan>,
    /// One log for each repetition.
    pub logs: Vec<Run>,
    /// Notes to the reader.
    pub notes: Vec<String>,
}

/// One difference between bench and simulation, and the resulting deviation of an output from the simulation: largest
/// differences in the transient, in the unit of the output; `None` if such a plant is impossible, or its run failed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Difference {
    /// `compliance of hd`, `sampling, delay and sensors`.
    pub source: String,
    /// Added alone to the simulation.
    pub added_to_simulation: Option<f64>,
    /// Removed alone from the bench.
    pub removed_from_bench: Option<f64>,
}

/// A number in the simulation and on the bench.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct Compared {
    /// In the simulation.
    pub simulation: f64,
    /// On the bench.
    pub bench: f64,
}

/// An output of a controller in the simulation and on the bench.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Response {
    /// The name of the output in the file.
    pub output: String,
    /// The signal that shows it without the noise of a sensor.
    pub signal: String,
    /// Its reference.
    pub reference: String,
    /// What it is.
    #[serde(rename = "unit")]
    pub physical: Physical,
    /// Mean over the last tenth of the run.
    pub steady_state: Compared,
    /// Largest deviation from the reference in the transient.
    pub max_deviation: Compared,
    /// Largest distance between simulation and bench in the transient.
    pub max_difference: f64,
    /// Its time, s.
    #[serde(rename = "at_s")]
    pub distance_at: f64,
    /// The causes of the difference.
    pub differences: Vec<Difference>,
}

/// A scenario under a controller, in the simulation and on the bench.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the variant.
    pub name: String,
    /// The controller in continuous time on the model that it was designed on, without Coulomb friction.
    pub simulated: Run,
    /// The controller as it runs, on the plant.
    pub measured: Run,
    /// Each output of the controller.
    pub responses: Vec<Response>,
}

/// A controller that was designed on a model, in the simulation and on a virtual bench.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoop {
    /// The controller design.
    pub design: Design,
    /// Duration of a transient after an event, s: ten time constants of the slowest pole of a channel.
    pub transient: f64,
    /// Each variant with this controller.
    pub experiments: Vec<Experiment>,
    /// Notes to the reader.
    pub notes: Vec<String>,
}

/// The whole procedure on a virtual bench: excitation, logging, identification, design, control.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchStudy {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// True values of the plant that the model does not contain.
    pub truth: Vec<TrueValue>,
    /// The excitation.
    pub plan: BenchPlan,
    /// The identification from its logs.
    pub identification: Identification,
    /// The controller with the identified values.
    pub closed_loop: ClosedLoop,
    /// Notes to the reader.
    pub notes: Vec<String>,
}
