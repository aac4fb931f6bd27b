//! Which faults sensors can tell, and by which relations between them.

use schemars::JsonSchema;
use serde::Serialize;

/// What `kardan analyze --parity` finds: chapter 2's plausibility, from the model itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Parity {
    /// What is read.
    pub sensors: Vec<String>,
    /// Inputs whose commands are known.
    pub commands: Vec<String>,
    /// Inputs of which nothing is known.
    pub unknown: Vec<String>,
    /// How many static residuals are independent.
    pub independent: usize,
    /// Whether `residuals` are all minimal ones; else they are a basis of them.
    pub exhaustive: bool,
    /// Minimal static residuals: each is zero whatever the model does, and of its sensors none can be left out.
    pub residuals: Vec<Residual>,
    /// Whether the verdicts on faults are decided exactly; else modulo random primes, wrong with a probability below 1e-12.
    pub exact: bool,
    /// What can be said of a fault of each sensor and of each input whose command is known.
    pub faults: Vec<FaultVerdict>,
    /// The smallest sets of sensors for what may be asked of them, decided modulo random primes.
    pub sets: Vec<SensorSets>,
}

/// A signal of a relation, with its derivative and coefficient.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct ParityTerm {
    /// The sensor or signal, or the torque of an input.
    pub signal: String,
    /// How often it is differentiated.
    pub derivative: usize,
    /// Its coefficient, as a fraction.
    pub coefficient: String,
    /// The same, rounded.
    pub value: f64,
    /// How far tolerances of the model may move it either way, one after the other, in all; 0 without any.
    pub tolerance: f64,
}

/// A sum of readings that is constant whatever the model does.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Residual {
    /// The sum; its first coefficient is one.
    pub terms: Vec<ParityTerm>,
    /// The unit of its value, that of the first signal.
    pub unit: String,
    /// Elements about whose operating point it is linearised; empty: it holds everywhere.
    pub linearised_at: Vec<String>,
    /// Whether angles are in it: then how its sensors are mounted adds a constant.
    pub up_to_constant: bool,
    /// Its value in the model, for sensors mounted at the zeros of their shafts; `null` if it depends on torques.
    pub constant: Option<f64>,
    /// From which size it is an alarm; `null` if its sensors have neither noise nor steps.
    pub threshold: Option<Threshold>,
}

/// A threshold with what follows from it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Threshold {
    /// Standard deviation of the residual from the noise of its sensors.
    pub noise: f64,
    /// Largest size that steps of the sensors give it.
    pub steps: f64,
    /// The threshold: the residual less its constant, beyond it for so many samples, is an alarm.
    pub threshold: f64,
    /// Samples one after the other.
    pub debounce: usize,
    /// Time between samples, s: the longest of its sensors.
    #[serde(rename = "sample_time_s")]
    pub sample_time: f64,
    /// Whether its sensors have different sample times: then motion within a sample adds to it.
    pub multirate: bool,
    /// No more false alarms than that, per hour, for white Gaussian noise.
    pub false_alarms_per_hour: f64,
    /// A change of the size in `smallest` is an alarm after that time at the latest, s.
    #[serde(rename = "detection_time_s")]
    pub detection_time: f64,
    /// For each of its signals the smallest change that is seen with a probability of 99.9 %, in its unit; of a residual in time that of the fault alone.
    pub min_detectable: Vec<f64>,
    /// The time constant τ, s, of the filter `1/(τ s + 1)ⁿ` that a residual in time goes through, n its highest derivative; `null` at one instant.
    #[serde(rename = "filter_s")]
    pub filter: Option<f64>,
}

/// Where something is added to a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FaultPlace {
    /// To what a sensor reads.
    #[default]
    Sensor,
    /// To what an input does.
    Input,
}

/// What can be said of an additive fault of any course.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct FaultVerdict {
    /// The sensor or input.
    pub fault: String,
    /// Which of these it is.
    pub location: FaultPlace,
    /// Whether the sensors show it at all, whatever the unknown inputs do.
    pub detectable: bool,
    /// Whether they go on showing it while it stays at one value; `false`: only as it changes. `null`: not decided.
    pub strongly_detectable: Option<bool>,
    /// The same as `shown` where the torques of friction are unknown too; `null` without friction.
    pub detectable_despite_friction: Option<bool>,
    /// Faults that it cannot be told from.
    pub not_isolable_from: Vec<String>,
    /// The derivatives that a residual needs that it moves; `null`: not shown, or not found with few.
    pub order: Option<usize>,
    /// Such a residual: zero whatever states and unknown inputs are.
    pub relation: Vec<ParityTerm>,
    /// Elements whose friction moves that residual too.
    pub friction_in_relation: Vec<String>,
    /// The unit of its value, that of its first term.
    pub unit: String,
    /// The unit of what the fault adds.
    pub fault_unit: String,
    /// From which size of it, filtered, it is an alarm; `null` if its sensors have neither noise nor steps, or no sample time.
    pub threshold: Option<Threshold>,
}

/// The smallest sets of sensors that reach a goal.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SensorSets {
    /// What is asked of them: `a fault of wg_motor is shown`.
    pub goal: String,
    /// What they are chosen from.
    pub candidates: Vec<String>,
    /// The sets; empty if there is none.
    pub sets: Vec<Vec<String>>,
    /// Whether all sets up to this size were tried.
    pub exhaustive: bool,
}
