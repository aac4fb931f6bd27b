use schemars::JsonSchema;
use serde::Serialize;

use super::{Span, Stability};

/// The loop of a controller with the parameters of its variant, linear at positions that its joints pass: in floating point,
/// without Coulomb friction and limits.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct LoopAlongPath {
    /// What turns, in words: `rk and cj`; empty if no joint is bent, and only parameters differ from those of the design.
    pub rotated_coordinates: String,
    /// Positions that are looked at.
    pub positions: usize,
    /// The angles of what turns, from and to, rad.
    #[serde(rename = "range_rad")]
    pub range: Span,
    /// Whether nothing grows at any of them, as far as floating point tells.
    pub stable: bool,
    /// Whether it is stable at all of them, but for what nobody holds.
    pub stability: Stability,
    /// Growth of the motion that grows most, or decays least, 1/s; negative if it decays.
    #[serde(rename = "growth_per_s")]
    pub growth: f64,
    /// Where that is, rad.
    #[serde(rename = "growth_at_rad")]
    pub growth_at: f64,
    /// What steps of references do to the outputs of other channels.
    pub interactions: Vec<PassedInteraction>,
}

/// What a step of one reference does to the output of another channel, where that is most.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct PassedInteraction {
    /// The reference that steps.
    pub reference: String,
    /// Size of the step, SI: the largest value that the scenario gives the reference, or one.
    pub step: f64,
    /// Its unit.
    pub step_unit: String,
    /// The other output; of a torque channel the torque that is felt there.
    pub signal: String,
    /// Its unit.
    pub unit: String,
    /// Its largest deviation, SI; infinite where the loop is unstable.
    pub largest: f64,
    /// Where that is, rad.
    #[serde(rename = "at_rad")]
    pub at: f64,
    /// What is acceptable of it, SI.
    pub acceptable: f64,
}

impl LoopAlongPath {
    /// The interaction that is most beyond what is acceptable of it.
    pub fn worst(&self) -> Option<&PassedInteraction> {
        let share = |one: &PassedInteraction| one.largest / one.acceptable;
        self.interactions.iter().max_by(|a, b| share(a).total_cmp(&share(b)))
    }

    /// Whether every interaction is acceptable, and nothing grows.
    pub fn acceptable(&self) -> bool {
        self.stable && self.interactions.iter().all(|one| one.largest <= one.acceptable)
    }
}
