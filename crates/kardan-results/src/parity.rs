//! Faults that sensors can detect and isolate, with the parity relations between them.

use schemars::JsonSchema;
use serde::Serialize;

/// The result of `kardan analyze --parity`: the plausibility checks of chapter 2, from the model itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Parity {
    /// The sensors.
    pub sensors: Vec<String>,
    /// Inputs whose commands are known.
    pub commands: Vec<String>,
    /// Unknown inputs.
    pub unknown: Vec<String>,
    /// Number of independent static residuals.
    pub independent: usize,
    /// Whether `residuals` are all minimal ones; else they are a basis of them.
    pub exhaustive: bool,
    /// Minimal static residuals: each is zero for every motion of the model, and needs all of its sensors.
    pub residuals: Vec<Residual>,
    /// Whether the verdicts on faults are decided exactly; else modulo random primes, wrong with a probability below 1e-12.
    pub exact: bool,
    /// The verdict on a fault of each sensor and of each input with a known command.
    pub faults: Vec<FaultVerdict>,
    /// The smallest sets of sensors for each goal, decided modulo random primes.
    pub sets: Vec<SensorSets>,
}

/// A signal of a relation, with its derivative and coefficient.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ParityTerm {
    /// The sensor or signal, or the torque of an input.
    pub signal: String,
    /// Its order of differentiation.
    pub derivative: usize,
    /// Its coefficient, as a fraction.
    pub coefficient: String,
    /// The same, rounded.
    pub value: f64,
    /// Sum of its changes by each tolerance of the model; 0 without any.
    pub tolerance: f64,
}

/// A sum of readings that is constant for every motion of the model.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Residual {
    /// The sum; its first coefficient is one.
    pub terms: Vec<ParityTerm>,
    /// The unit of its value, that of the first signal.
    pub unit: String,
    /// Elements about whose operating point it is linearised; empty: it is valid everywhere.
    pub linearised_at: Vec<String>,
    /// Whether it contains angles: then the mounting of its sensors adds a constant.
    pub up_to_constant: bool,
    /// Its value in the model, for sensors mounted at the zeros of their shafts; `null` if it depends on torques.
    pub constant: Option<f64>,
    /// The threshold of an alarm; `null` if its sensors have neither noise nor quantisation.
    pub threshold: Option<Threshold>,
}

/// A threshold with its properties.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Threshold {
    /// Standard deviation of the residual from the noise of its sensors.
    pub noise: f64,
    /// Its largest magnitude from the quantisation of the sensors.
    pub steps: f64,
    /// The threshold: the residual minus its constant beyond it, for this number of samples, is an alarm.
    pub threshold: f64,
    /// Number of consecutive samples.
    pub debounce: usize,
    /// Time between samples, s: the longest of its sensors.
    #[serde(rename = "sample_time_s")]
    pub sample_time: f64,
    /// Whether its sensors have different sample times: then motion within a sample adds to it.
    pub multirate: bool,
    /// Upper bound on false alarms per hour, for white Gaussian noise.
    pub false_alarms_per_hour: f64,
    /// Longest time from a change of the size in `smallest` to the alarm, s.
    #[serde(rename = "detection_time_s")]
    pub detection_time: f64,
    /// For each of its signals the smallest change detected with a probability of 99.9 %, in its unit; of a residual in time that of the fault alone.
    pub min_detectable: Vec<f64>,
    /// The time constant τ, s, of the filter `1/(τ s + 1)ⁿ` of a residual in time, n its highest derivative; `null` at one instant.
    #[serde(rename = "filter_s")]
    pub filter: Option<f64>,
}

/// The location of an additive fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FaultPlace {
    /// At a sensor reading.
    #[default]
    Sensor,
    /// At an input.
    Input,
}

/// The verdict on an additive fault of any time function.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FaultVerdict {
    /// The sensor or input.
    pub fault: String,
    /// Which of these it is.
    pub location: FaultPlace,
    /// Whether it is detectable, for all unknown inputs.
    pub detectable: bool,
    /// Whether it stays detectable while it is constant; `false`: only as it changes. `null`: not decided.
    pub strongly_detectable: Option<bool>,
    /// The same as `detectable` where the torques of friction are unknown too; `null` without friction.
    pub detectable_despite_friction: Option<bool>,
    /// Faults from which it cannot be isolated.
    pub not_isolable_from: Vec<String>,
    /// Highest derivative of a residual that it affects; `null`: not detectable, or not found with few derivatives.
    pub order: Option<usize>,
    /// Such a residual: zero for all states and unknown inputs.
    pub relation: Vec<ParityTerm>,
    /// Elements whose friction also affects that residual.
    pub friction_in_relation: Vec<String>,
    /// The unit of its value, that of its first term.
    pub unit: String,
    /// The unit of the fault.
    pub fault_unit: String,
    /// The threshold of an alarm, filtered; `null` if its sensors have neither noise nor quantisation, or no sample time.
    pub threshold: Option<Threshold>,
}

/// The smallest sets of sensors that reach a goal.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SensorSets {
    /// Their goal: `a fault of wg_motor is shown`.
    pub goal: String,
    /// The candidates.
    pub candidates: Vec<String>,
    /// The sets; empty if there is none.
    pub sets: Vec<Vec<String>>,
    /// Whether all sets up to this size were tried.
    pub exhaustive: bool,
}
