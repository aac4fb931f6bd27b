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
    pub comparison_tolerance: f64,
    /// Whether the second run came through the same events in the same order. Times between an event and its like in the other run
    /// are left out of the comparison; where they differ, nothing is left out.
    pub same_events: bool,
    /// Whether rounding keeps one of the runs from being as accurate as asked: then three times the difference is told, otherwise a third.
    pub limited_by_rounding: bool,
    /// Where sensors count: the first reading of a sampled law that is nearer to the boundary of two counts than the run may err, or that came
    /// out otherwise in the second run. From there on the run may go another way, whatever the tolerance; ten times the difference is told, to
    /// the second run and to one in which such readings come out on their other side, where the second run did not part soon.
    pub quantisation_ambiguity: Option<UndecidedCount>,
    /// Of each unit the signal with the largest error, and that error.
    pub errors: Vec<SignalError>,
    /// Of angles, speeds, charges and currents the one whose error is largest beside its own size, where that is a tenth of it or more.
    pub unreliable: Option<UnreliableSignal>,
}

/// A signal of which not even the first digit is known.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UnreliableSignal {
    /// Name of the signal.
    pub signal: String,
    /// Its unit.
    pub unit: Physical,
    /// The largest estimated error, in that unit; never more than the difference to the second run.
    pub error: f64,
    /// The largest amount of the signal, in that unit.
    pub size: f64,
}

/// A reading that may as well be one count more or less.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct UndecidedCount {
    /// When it is read, s.
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
