//! What deviations of the plant do to a designed loop.

use schemars::JsonSchema;
use serde::Serialize;

use super::Interval;

/// The linear loop of a design over a box of plants: sampled with a seed, and its worst corners searched for.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Robustness {
    /// What varies, in words: `20 % of every inertia, damping and stiffness`.
    pub range: String,
    /// Coefficients that vary.
    pub parameters: Vec<VariedParameter>,
    /// Plants drawn at random (uniformly, independently).
    pub samples: usize,
    /// Seed of the random numbers.
    pub seed: u64,
    /// How many of them are stable.
    pub stable: usize,
    /// Whether the worst corner that the search found is stable.
    pub worst_stable: bool,
    /// Spectral radius per sample time (of a loop in continuous time, per second).
    pub spectral_radius: Spread,
    /// What a step of one channel's reference does to the others.
    pub interactions: Vec<Interaction>,
    /// Largest torque that a step asks of a motor.
    pub peaks: Vec<Interaction>,
    /// Least margins of each motor; empty where they are not known.
    pub margins: Vec<BoxMargin>,
}

/// How wrong the torque of a motor may be alone, over some plants of the box and the worst corners that were found: the least of
/// these, not of the whole box.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct BoxMargin {
    /// The motor.
    pub motor: String,
    /// How many plants were looked at.
    pub plants: usize,
    /// How many more are not stable, or could not be computed.
    pub unstable: usize,
    /// Disk margin with the nominal plant.
    pub nominal: f64,
    /// The least disk margin.
    pub disk: f64,
    /// The nearest factors below and above one that are too much for one of them; 0 and infinity if none is.
    pub gain: [f64; 2],
    /// The least turn of the phase that is too much for one of them, rad.
    #[serde(rename = "phase_rad")]
    pub phase: f64,
    /// Where the disk margin is least: each coefficient's factor.
    pub at: Vec<f64>,
}

/// A coefficient that varies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct VariedParameter {
    /// Its name.
    pub name: String,
    /// Its smallest and largest factor.
    pub factors: Interval,
}

/// What a step does to a signal, over the box.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Interaction {
    /// The reference that steps.
    pub reference: String,
    /// By how much, SI.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// What is watched: `fs.phi: torque of driver`, `rk.phi`, a motor.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Largest size during the step.
    pub size: Spread,
}

/// How a number spreads over a box of plants.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Spread {
    /// Of the nominal plant.
    pub nominal: f64,
    /// Half of the sampled plants are below.
    pub median: f64,
    /// 90 % of them are below.
    pub q90: f64,
    /// 99 % of them are below.
    pub q99: f64,
    /// Largest of them.
    pub sampled: f64,
    /// Largest that the search over the corners of the box found; infinite where the loop is unstable.
    pub worst: f64,
    /// Where: each coefficient's factor.
    pub at: Vec<f64>,
}
