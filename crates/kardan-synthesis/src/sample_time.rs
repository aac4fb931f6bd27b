//! When a law runs, and in which arithmetic.

use std::sync::Arc;

use super::blending::blending_signal;
use super::error::CONTROLLER;
use super::sampled::sampled_with;
use super::{Clock, Law, SynthesisError};
use kardan_schema::schema::Values;

/// Shortest sample time of a controller, s.
pub const SHORTEST_SAMPLE_TIME: f64 = kardan_schema::schema::SHORTEST_PERIOD;

/// Longest sample time of a controller, s.
pub const LONGEST_SAMPLE_TIME: f64 = 1.0;

/// Longest delay of a controller, in sample times.
pub const LONGEST_DELAY: f64 = 10.0;

/// When and in which arithmetic the controller with these keys runs; `None`: in continuous time.
///
/// # Errors
/// If the sample time or the delay is out of range, or other keys of sampling are given without a sample time.
pub fn clock(values: &Values) -> Result<Option<Clock>, SynthesisError> {
    let allowed = SHORTEST_SAMPLE_TIME..=LONGEST_SAMPLE_TIME;
    let Some(period) = values.number("sample_time") else {
        return match ["delay", "precision", "blending_signal"].into_iter().find(|key| values.has(key)) {
            Some(key) => Err(SynthesisError::at(
                format!("`{key}` is for a controller with a `sample_time`; this one runs in continuous time"),
                key,
                CONTROLLER,
                format!("add `sample_time = \"1 ms\"`, or remove `{key}`"),
            )),
            None => Ok(None),
        };
    };
    if !allowed.contains(&period) {
        let wrong = if period > LONGEST_SAMPLE_TIME { "longer than 1 s" } else { "shorter than a microsecond" };
        let message = format!("a sample time of {period} s is {wrong}");
        return Err(SynthesisError::at(message, "sample_time", CONTROLLER, "write a time such as \"1 ms\""));
    }
    let delay = values.number_or_default("delay");
    if delay > LONGEST_DELAY * period {
        let message = format!("a delay of {delay} s is longer than ten sample times of {period} s");
        let help = "write a delay such as \"1 ms\", or a longer `sample_time`";
        return Err(SynthesisError::at(message, "delay", CONTROLLER, help));
    }
    Ok(Some(Clock { period, delay, single: values.word("precision") == Some("single") }))
}

/// The law as it runs: at its sample time, if it has one.
///
/// # Errors
/// If its keys are wrong, or its numbers overflow at this sample time.
pub fn implemented(law: Arc<dyn Law>, values: &Values) -> Result<Arc<dyn Law>, SynthesisError> {
    match clock(values)? {
        Some(clock) => {
            let law = sampled_with(law, clock, blending_signal(values));
            law.ok_or_else(|| SynthesisError::sampled_overflow(clock.period))
        }
        None => Ok(law),
    }
}
