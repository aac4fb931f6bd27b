//! When a law runs, and in which arithmetic.

use std::sync::Arc;

use super::blending::blending_signal;
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
            Some(key) => Err(SynthesisError::NeedsSampleTime(key)),
            None => Ok(None),
        };
    };
    if !allowed.contains(&period) {
        return Err(SynthesisError::SampleTime(period));
    }
    let delay = values.number_or_default("delay");
    if delay > LONGEST_DELAY * period {
        return Err(SynthesisError::Delay { delay, period });
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
            law.ok_or(SynthesisError::SampledOverflow(clock.period))
        }
        None => Ok(law),
    }
}
