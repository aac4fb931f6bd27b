use schemars::JsonSchema;
use serde::Serialize;

use super::Physical;

/// How far the integration may have led the signals of a run astray: an estimate from a second run at a looser tolerance.
///
/// Errors follow the tolerance, so that the difference of the two runs is about the error of the looser one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Accuracy {
    /// Relative tolerance of the run.
    pub tolerance: f64,
    /// Relative tolerance of the second run.
    pub looser: f64,
    /// Whether the second run came through the same events in the same order. Times between an event and its like in the other run
    /// are left out of the comparison; where they differ, nothing is left out.
    pub same_events: bool,
    /// Whether rounding keeps one of the runs from being as accurate as asked: then three times the difference is told, otherwise a third.
    pub rounded: bool,
    /// Of each unit the signal with the largest error, and that error.
    pub errors: Vec<SignalError>,
}

/// The estimated error of a signal.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct SignalError {
    /// Name of the signal.
    pub signal: String,
    /// Its unit.
    pub unit: Physical,
    /// The largest estimated error, in that unit.
    pub error: f64,
}
