//! Results: estimated errors of the signals of a run.

use schemars::JsonSchema;
use serde::Serialize;

use super::Physical;

/// Estimated integration error of the signals of a run, from a second run at a looser tolerance.
///
/// Errors are proportional to the tolerance, so the difference of the two runs is about the error of the looser one.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct Accuracy {
    /// Relative tolerance of the run.
    pub tolerance: f64,
    /// Relative tolerance of the second run.
    pub comparison_tolerance: f64,
    /// Whether the second run had the same events in the same order. Times between an event and its counterpart in the other run
    /// are left out of the comparison; if the events differ, no time is left out.
    pub same_events: bool,
    /// Whether rounding limits the accuracy of one of the runs below its tolerance: then kardan reports three times the difference, otherwise a third.
    pub limited_by_rounding: bool,
    /// For quantised sensors: the first reading of a sampled law that is nearer to the boundary of two counts than the run error, or that came
    /// out differently in the second run. From there on the trajectory may differ at any tolerance; kardan reports ten times the difference, to
    /// the second run and to one in which such readings take the other count, if the second run did not deviate soon.
    pub quantisation_ambiguity: Option<UndecidedCount>,
    /// Of each unit the signal with the largest error, and that error.
    pub errors: Vec<SignalError>,
    /// Of angles, speeds, charges and currents the one with the largest error relative to its magnitude, if that is a tenth or more.
    pub unreliable: Option<UnreliableSignal>,
}

/// A signal without a single reliable digit.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UnreliableSignal {
    /// Name of the signal.
    pub signal: String,
    /// Its unit.
    pub unit: Physical,
    /// The largest estimated error, in that unit; never more than the difference to the second run.
    pub error: f64,
    /// The largest magnitude of the signal, in that unit.
    pub size: f64,
}

/// A reading that may be one count more or less.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UndecidedCount {
    /// Time of the reading, s.
    pub time: f64,
    /// Name of the sensor.
    pub sensor: String,
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
