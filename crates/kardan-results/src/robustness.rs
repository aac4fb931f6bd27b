//! Effects of plant deviations on a designed loop.

use schemars::JsonSchema;
use serde::Serialize;

use super::Interval;

/// The linear loop of a design over a box of plants: random samples with a seed, and a search for the worst corners.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Robustness {
    /// The varied quantities as text: `20 % of every inertia, damping and stiffness`.
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
    /// Effects of a step of one channel's reference on the others.
    pub interactions: Vec<Interaction>,
    /// Largest torque command of a motor after a step.
    pub peaks: Vec<Interaction>,
    /// Least margins of each motor; empty where they are not known.
    pub margins: Vec<BoxMargin>,
}

/// Margins of the torque of a motor alone, over some plants of the box and the worst corners found: the least of
/// these, not of the whole box.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct BoxMargin {
    /// The motor.
    pub motor: String,
    /// Number of evaluated plants.
    pub plants: usize,
    /// Number of further ones that are not stable, or could not be computed.
    pub unstable: usize,
    /// Disk margin with the nominal plant.
    pub nominal: f64,
    /// The least disk margin.
    pub disk: f64,
    /// The nearest gain factors below and above one that destabilise one of them; 0 and infinity if none does.
    pub gain: [f64; 2],
    /// The least phase change that destabilises one of them, rad.
    #[serde(rename = "phase_rad")]
    pub phase: f64,
    /// The point with the least disk margin: each coefficient's factor.
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

/// The effect of a step on a signal, over the box.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Interaction {
    /// The reference that steps.
    pub reference: String,
    /// Step size, SI.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// The observed signal: `fs.phi: torque of driver`, `rk.phi`, a motor.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Largest magnitude during the step.
    pub size: Spread,
}

/// Statistics of a number over a box of plants.
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
    /// Its point: each coefficient's factor.
    pub at: Vec<f64>,
}
