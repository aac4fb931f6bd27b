//! Effects of faults on a model: each fault in each variant at each value, detected or not, harmful or not.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::DisplayUnit;

/// Every fault of a list in every variant and at every value of a list, against the same runs without it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Safety {
    /// Name of the model.
    pub model: String,
    /// From the file.
    pub description: String,
    /// The condition of detection; `null` if the file has none.
    pub detected: Option<String>,
    /// The longest time to detection, s.
    pub detection_time_limit: Option<f64>,
    /// The measured unwanted effects.
    pub effects: Vec<SafetyEffect>,
    /// One for each run: those without a fault before those with one.
    pub rows: Vec<SafetyRow>,
    /// Rows that were not computed.
    pub missing: usize,
    /// Statistics of the monitors of the file in all these runs.
    pub monitors: Vec<MonitorOutcome>,
    /// Notes to the reader.
    pub notes: Vec<String>,
    /// Reasons to doubt the table.
    pub warnings: Vec<String>,
}

impl Safety {
    /// Rows with a verdict that does not pass.
    pub fn failing(&self) -> impl Iterator<Item = &SafetyRow> {
        self.rows.iter().filter(|row| !row.verdict.passes())
    }

    /// Whether all was computed and every verdict passes.
    pub fn passes(&self) -> bool {
        self.missing == 0 && self.failing().next().is_none()
    }
}

/// An unwanted effect.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SafetyEffect {
    /// Its name.
    pub name: String,
    /// As text: `max_abs rk.phi within 0.1 s, against no fault`.
    pub text: String,
    /// SI unit.
    pub unit: String,
    /// The unit of its bounds in the file, if that differs.
    pub display: Option<DisplayUnit>,
    /// Bound from above, SI.
    pub below: Option<f64>,
    /// Bound from below, SI.
    pub above: Option<f64>,
}

/// A parameter and its value.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SafetyValue {
    /// The parameter.
    pub name: String,
    /// Its value as source text.
    pub value: String,
}

/// A state that a state machine enters.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct StateEntered {
    /// The state.
    pub state: String,
    /// Time after the start of the fault, s.
    pub after: f64,
}

/// An effect in a run.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct EffectMeasured {
    /// SI; `null` if it could not be measured.
    pub measured: Option<f64>,
    /// Whether its bounds are satisfied; `null` if it has none.
    pub within_bounds: Option<bool>,
}

/// A run with its faults, or without one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct SafetyRow {
    /// The faults; empty: the run without a fault.
    pub faults: Vec<String>,
    /// The variant.
    pub variant: String,
    /// Values of parameters.
    pub values: Vec<SafetyValue>,
    /// When the first fault begins, s.
    pub fault_time: Option<f64>,
    /// Time to the first row in which the condition of detection is true and is false without the fault, from the start of the fault that started
    /// last before it, s; of a run without a fault the time of the first row in which it is true.
    pub detection_time: Option<f64>,
    /// Time between the row of the detection and the previous row, s: the detection may be earlier by up to this time.
    pub detection_resolution: Option<f64>,
    /// States that the state machine of the file enters after the start, and does not enter without the fault.
    pub reaction: Vec<StateEntered>,
    /// The effects, in the order of [`Safety::effects`].
    pub effects: Vec<EffectMeasured>,
    /// Number of the effect nearest to its bound, or farthest beyond it.
    pub worst: Option<usize>,
    /// Its verdict.
    pub verdict: SafetyVerdict,
    /// The reason, if the verdict does not contain it.
    pub note: Option<String>,
    /// The command that runs it again.
    pub command: String,
}

/// The verdict of a row of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum SafetyVerdict {
    /// Without a fault nothing is detected.
    #[serde(rename = "no alarm")]
    NoAlarm,
    /// Without a fault something is detected.
    #[serde(rename = "false alarm")]
    FalseAlarm,
    /// Detected in time, and no effect beyond its bound.
    #[serde(rename = "detected")]
    Detected,
    /// Detected in time, and an effect beyond its bound.
    #[serde(rename = "detected, harmful")]
    DetectedHarmful,
    /// Not detected, and all effects within bounds.
    #[serde(rename = "harmless")]
    Harmless,
    /// Detected too late, and all effects within bounds.
    #[serde(rename = "detected late, harmless")]
    LateHarmless,
    /// Detected too late, and an effect beyond its bound.
    #[serde(rename = "detected late, harmful")]
    LateHarmful,
    /// Not detected, and an effect beyond its bound.
    #[serde(rename = "not detected and harmful")]
    Harmful,
    /// Not detected in time, and no effect has a bound that defines harm.
    #[serde(rename = "not detected")]
    NotDetected,
    /// No element of this variant is affected by the fault.
    #[serde(rename = "not in this loop")]
    Absent,
    /// The run was impossible or ended early.
    #[serde(rename = "run failed")]
    #[default]
    Failed,
}

impl SafetyVerdict {
    /// Whether it passes.
    pub fn passes(self) -> bool {
        matches!(self, Self::NoAlarm | Self::Detected | Self::Harmless | Self::LateHarmless | Self::Absent)
    }
}

impl fmt::Display for SafetyVerdict {
    /// Its text in the table, as in JSON.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.serialize(f)
    }
}

/// Statistics of a monitor in all runs.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct MonitorOutcome {
    /// The block.
    pub name: String,
    /// Faults that raise it, if it is not raised without them.
    pub raised_by: Vec<String>,
    /// Variants in which it is raised without a fault.
    pub false_alarms: Vec<String>,
}
