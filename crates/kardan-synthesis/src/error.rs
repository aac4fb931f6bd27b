//! Errors of designing a law.

use super::decoupling::{CompensationError, NotDecouplable};
use super::inversion::BlockError;
use super::observer::ObserverError;
use super::regulator::{PlacementError, RiccatiError};
use kardan_math::names::quoted;

/// Why a law cannot be designed, and what to do about it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct SynthesisError {
    /// Why.
    pub message: String,
    /// What to do.
    pub advice: Advice,
}

/// Label and help for a [`SynthesisError`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Advice {
    /// Words of the controller's table that are to blame.
    pub named: Vec<String>,
    /// The label there.
    pub label: &'static str,
    /// What to do.
    pub help: String,
}

/// The label of a table as a whole.
pub(super) const CONTROLLER: &str = "this controller";

impl SynthesisError {
    /// About some words of the controller's table, with a label there and what to do.
    pub(super) fn of(
        message: impl Into<String>,
        named: &[String],
        label: &'static str,
        help: impl Into<String>,
    ) -> Self {
        Self { message: message.into(), advice: Advice { named: named.to_vec(), label, help: help.into() } }
    }

    /// About one word of the table.
    pub(super) fn at(message: impl Into<String>, named: &str, label: &'static str, help: impl Into<String>) -> Self {
        Self::of(message, &[named.into()], label, help)
    }

    /// About the table as a whole.
    pub(super) fn whole(message: impl Into<String>, help: impl Into<String>) -> Self {
        Self::of(message, &[], CONTROLLER, help)
    }

    /// Two channels have the same `what`: `input`, `output` or `reference`.
    pub(super) fn duplicate(name: &str, what: &str) -> Self {
        let message = format!("`{name}` is used by two channels; every channel needs its own {what}");
        Self::at(message, name, "used here", format!("name another {what} in each channel"))
    }

    /// The requested dynamics of a channel are impossible.
    pub(super) fn compensation(output: &str, error: &CompensationError) -> Self {
        let help = match error {
            CompensationError::Count { degree, .. } => {
                format!("give {degree} pole{}, or a frequency", if *degree == 1 { "" } else { "s" })
            }
            CompensationError::NoConjugate { .. } => "write pairs: `\"-14 ± 14.3j\"`".into(),
            CompensationError::NotStable { .. } => "choose poles with a negative real part".into(),
            CompensationError::NotPositive { .. } => "choose a value above zero".into(),
        };
        Self::at(format!("the channel of `{output}`: {error}"), output, "this channel", help)
    }

    /// Static state feedback cannot decouple the outputs; with alternatives, or why there are none.
    pub(super) fn not_static(outputs: &[String], error: &NotDecouplable, reasons: &[String]) -> Self {
        let reasons: String = reasons.iter().map(|reason| format!("; {reason}")).collect();
        let help = "set `feedback` as the message states, or choose other outputs or inputs";
        Self::of(format!("{error}{reasons}"), outputs, "not decoupled", help)
    }

    /// No feedback decouples the outputs.
    pub(super) fn impossible(outputs: &[String], reasons: &[String]) -> Self {
        let message = format!("no feedback at all decouples the outputs {}: {}", quoted(outputs), reasons.join("; "));
        let help = "choose other outputs or inputs; no controller can do this";
        Self::of(message, outputs, "not independent", help)
    }

    /// The observer cannot be designed.
    pub(super) fn observer(sensors: &[String], error: &ObserverError) -> Self {
        let help = match error {
            ObserverError::NotObservable { .. } | ObserverError::NotDetectable { .. } => {
                "add a sensor, or estimate fewer torques: `disturbances = [...]`"
            }
            ObserverError::WrongNumber { .. } => "give as many poles as the message states",
            ObserverError::NotSelfConjugate { .. } => "write pairs: `\"-50 ± 10j\"`, for each sensor",
            _ => "choose other sensors, poles or noises",
        };
        Self::of(format!("the observer: {error}"), sensors, "measured here", help)
    }

    /// A key that the method of the observer does not use.
    pub(super) fn idle_key(key: &str, method: &str) -> Self {
        let message = format!("the observer's method `{method}` does not use `{key}`");
        Self::whole(message, format!("remove `{key}`, or change `method`"))
    }

    /// An output whose value at the operating point is unknown.
    pub(super) fn not_at_rest(output: &str) -> Self {
        let message =
            format!("`{output}` depends directly on the motor torques, so its value at the operating point is unknown");
        Self::whole(message, "control an angle, a speed or the torque of a torsion bar, or leave out `at`")
    }

    /// A law that is designed for a sample time, without one.
    pub(super) fn sampled_only(law: &str) -> Self {
        let message = format!("the law `{law}` is designed for a sample time, and none is given");
        Self::whole(message, "add `sample_time = \"1 ms\"`, and the `delay`")
    }

    /// Numbers of a sampled controller that are too large at a sample time, s.
    pub(super) fn sampled_overflow(period: f64) -> Self {
        let message =
            format!("the controller cannot run at a sample time of {period} s: its numbers overflow within a sample");
        Self::at(message, "sample_time", CONTROLLER, "choose a shorter `sample_time`")
    }

    /// A gain that is too large for a number.
    pub(super) fn too_large() -> Self {
        Self::whole("a gain is too large for a number", "check the exponents of the model's numbers")
    }
}

impl From<PlacementError> for SynthesisError {
    fn from(error: PlacementError) -> Self {
        let help = match error {
            PlacementError::NotSelfConjugate { .. } => "write pairs: `\"-14 ± 14.3j\"`",
            PlacementError::WrongNumber { .. } => {
                "give as many poles as states: two for each reduced coordinate; one for a charge that acts on nothing, or for a coordinate without inertia; none for one that is both"
            }
            PlacementError::FixedModes { .. } => "add a motor that reaches them, or name them as poles",
            _ => "spread the poles",
        };
        Self::whole(error.to_string(), help)
    }
}

impl From<RiccatiError> for SynthesisError {
    fn from(error: RiccatiError) -> Self {
        let help = match error {
            RiccatiError::NotStabilisable { .. } => "add a motor that reaches them",
            RiccatiError::NotDetectable { .. } => "give the motion a weight in `max_acceptable`",
            _ => "choose other weights",
        };
        Self::whole(error.to_string(), help)
    }
}

impl From<BlockError> for SynthesisError {
    fn from(error: BlockError) -> Self {
        Self::of(error.to_string(), &[], "these channels", "choose other outputs or inputs")
    }
}
