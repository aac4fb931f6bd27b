//! Results: the loop linearised at positions along the paths of its joints.

use schemars::JsonSchema;
use serde::Serialize;

use super::{Span, Stability};

/// The loop of a controller with the parameters of its variant, linearised at positions of its joints: in floating point,
/// without Coulomb friction and limits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopAlongPath {
    /// The rotating coordinates as text: `rk and cj`; empty if all joints are straight, and only parameters differ from those of the design.
    pub rotated_coordinates: String,
    /// Number of evaluated positions.
    pub positions: usize,
    /// The range of the angles, rad.
    #[serde(rename = "range_rad")]
    pub range: Span,
    /// Whether it is unstable at none of them, in floating point.
    pub stable: bool,
    /// Whether it is stable at all of them, except for uncontrolled motions.
    pub stability: Stability,
    /// Growth of the motion that grows most, or decays least, 1/s; negative if it decays.
    #[serde(rename = "growth_per_s")]
    pub growth: f64,
    /// Its position, rad.
    #[serde(rename = "growth_at_rad")]
    pub growth_at: f64,
    /// Effects of reference steps on the outputs of other channels.
    pub interactions: Vec<PassedInteraction>,
}

/// The effect of a step of one reference on the output of another channel, at the position where it is largest.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PassedInteraction {
    /// The reference that steps.
    pub reference: String,
    /// Size of the step, SI: the largest value that the scenario gives the reference, or one.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// The other output; of a torque channel its torque.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Its largest deviation, SI; infinite where the loop is unstable.
    pub largest: f64,
    /// Its position, rad.
    #[serde(rename = "at_rad")]
    pub at: f64,
    /// The acceptable value, SI.
    pub acceptable: f64,
}

impl LoopAlongPath {
    /// The interaction with the largest ratio to its acceptable value.
    pub fn worst(&self) -> Option<&PassedInteraction> {
        let share = |one: &PassedInteraction| one.largest / one.acceptable;
        self.interactions.iter().max_by(|a, b| share(a).total_cmp(&share(b)))
    }

    /// Whether every interaction is acceptable, and no position is unstable.
    pub fn acceptable(&self) -> bool {
        self.stable && self.interactions.iter().all(|one| one.largest <= one.acceptable)
    }
}
