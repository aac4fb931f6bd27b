use schemars::JsonSchema;
use serde::Serialize;

use super::{Design, Identification, Physical, Run};

/// A value of the plant on a virtual bench.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TrueValue {
    /// `wg.damping`, or the name of a parameter.
    pub name: String,
    /// SI.
    pub value: f64,
    /// SI unit; empty for a plain number.
    pub unit: String,
    /// What the model has; `None` if it has no such value.
    pub nominal: Option<f64>,
}

/// A part of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchPoint {
    /// When its measurement begins, s.
    pub from: f64,
    /// When it ends, s.
    pub until: f64,
    /// Speed of each shaft, rad/s; the largest sizes in a section of sines or steps.
    pub speeds: Vec<f64>,
    /// Torque of each motor that the model expects, N m; the largest sizes in a section.
    pub torques: Vec<f64>,
}

/// What a plan promises for one parameter.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct PlannedParameter {
    /// `wg.damping`
    pub name: String,
    /// Value of the model, SI.
    pub nominal: f64,
    /// SI unit.
    pub unit: String,
    /// Standard error to be expected from white noise of the logged torques alone; `None` if none is stated.
    pub standard_error: Option<f64>,
}

/// An excitation that is designed to tell parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchPlan {
    /// `constant_speeds`, `multisine` or `random_steps`.
    pub kind: String,
    /// What it is to tell.
    pub parameters: Vec<PlannedParameter>,
    /// Coefficients that this kind of motion, or the choice of the file, leaves to the model.
    pub fixed: Vec<String>,
    /// Names of the shafts, in the order of the speeds.
    pub shafts: Vec<String>,
    /// Names of the motors, in the order of the torques.
    pub motors: Vec<String>,
    /// The parts chosen, in the order of the log.
    pub points: Vec<BenchPoint>,
    /// Candidates that keep the limits.
    pub candidates: usize,
    /// `ln det(XᵀX)` of the parts chosen.
    pub log_det: f64,
    /// The same of all candidates, for as many parts as were chosen.
    pub undesigned_log_det: f64,
    /// How many parts of the plan tell as much as one of the undesigned plan, `exp((log det − undesigned)/parameters)`.
    pub gain: f64,
    /// Length, s.
    pub duration: f64,
}

/// What a virtual bench gives.
#[derive(Debug, Clone, PartialEq)]
pub struct Bench {
    /// Name of the model.
    pub model: String,
    /// What the plant has and the model does not know.
    pub truth: Vec<TrueValue>,
    /// The excitation; `None` where the file's own controllers and scenario ran.
    pub plan: Option<BenchPlan>,
    /// One log for each repetition.
    pub logs: Vec<Run>,
    /// What the reader must know.
    pub notes: Vec<String>,
}

/// One of the things in which the bench differs from the simulation, and how far an output gets from the simulation by it: largest
/// distances in the transient, in the unit of the output; `None` where such a plant cannot be, or its run failed.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Difference {
    /// `compliance of hd`, `sampling, delay and sensors`.
    pub source: String,
    /// Put into the simulation alone.
    pub added_to_simulation: Option<f64>,
    /// Taken from the bench alone.
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
    /// The output as the file names it.
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
    /// Farthest from the reference in the transient.
    pub max_deviation: Compared,
    /// Largest distance between simulation and bench in the transient.
    pub max_difference: f64,
    /// When that is, s.
    #[serde(rename = "at_s")]
    pub distance_at: f64,
    /// What makes them differ.
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
    /// The controller as it was designed.
    pub design: Design,
    /// How long after an event a transient lasts, s: ten time constants of the slowest pole of a channel.
    pub transient: f64,
    /// Each variant in which it runs.
    pub experiments: Vec<Experiment>,
    /// What the reader must know.
    pub notes: Vec<String>,
}

/// The whole way on a virtual bench: excited, logged, identified, designed, controlled.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchStudy {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// What the plant has and the model does not know.
    pub truth: Vec<TrueValue>,
    /// The excitation.
    pub plan: BenchPlan,
    /// What was found in its logs.
    pub identification: Identification,
    /// The controller on the values found.
    pub closed_loop: ClosedLoop,
    /// What the reader must know.
    pub notes: Vec<String>,
}
