//! From which size a residual is an alarm: what noise and steps of its sensors make of it.

use super::PreparedVariant;
use super::signals::ParitySettings;
use crate::analysis::OutputSignal;
use crate::equations::Measured;
use crate::identify::{normal_quantile, two_sided_normal};
use crate::names::SignalName;
use crate::results::Threshold;
use crate::simulate::signal_names;
use kardan_rt::functions::{exp, hypot, ln};

/// What a sensor does to a reading.
pub(super) struct Reading {
    pub unit: String,
    /// Standard deviation of its noise.
    noise: f64,
    /// What its steps add, at least and at most.
    steps: [f64; 2],
    sample_time: Option<f64>,
}

/// What the sensors of these outputs do; other signals are read as they are.
pub(super) fn readings(variant: &PreparedVariant, outputs: &[OutputSignal]) -> Vec<Reading> {
    let equations = &variant.reduced.equations;
    let known = signal_names(&variant.reduced, &variant.scenario);
    let one = |output: &OutputSignal| {
        let named = |name: &String| *name == output.name || SignalName::new(name).element == output.name;
        let unit = known.iter().find(|(name, _)| named(name)).map_or("", |(_, physical)| physical.unit()).to_string();
        let sensor = equations.sensors.iter().find(|(name, _)| *name == output.name).map(|(_, sensor)| sensor);
        let Some(sensor) = sensor else { return Reading { unit, noise: 0.0, steps: [0.0; 2], sample_time: None } };
        let sample_time = sensor.sample_time.as_ref().map(crate::units::Exact::to_f64);
        // The reading step · ⌊x/step + phase⌋ differs from x by more than (phase − 1) and at most phase steps.
        let rounded = |step: f64| [step * (sensor.phase - 1.0), step * sensor.phase];
        let steps = match (&sensor.measured, sensor.resolution) {
            (_, None) => [0.0; 2],
            (Measured::Speed(_), Some(step)) => sample_time.map_or([0.0; 2], |time| [-step / time, step / time]),
            (Measured::SpringTorque(element), Some(step)) => {
                let own = equations.springs.iter().filter(|spring| spring.element == *element);
                let stiffness: f64 = own.map(|spring| spring.value.stiffness.to_f64()).sum();
                rounded(step).map(|error| stiffness * error)
            }
            (_, Some(step)) => rounded(step),
        };
        Reading { unit, noise: sensor.noise.unwrap_or(0.0), steps, sample_time }
    };
    outputs.iter().map(one).collect()
}

/// The probability that a change is seen.
const SEEN: f64 = 0.999;

/// The least probability that one sample is within the threshold.
const WITHIN: f64 = 0.7;

/// The threshold of a residual of so much of each reading; `None` where nothing disturbs it.
///
/// With white Gaussian noise of standard deviation σ and an error b of all steps, a sample lies beyond `b + zσ` with at most the probability
/// p of a normal number beyond ±z, and an alarm begins at a sample with at most pᴺ, N the samples of the debounce.
pub(super) fn threshold(errors: &[(f64, &Reading)], asked: &ParitySettings) -> Option<Threshold> {
    let noise = errors.iter().fold(0.0, |sum, (x, reading)| hypot(sum, x * reading.noise));
    let end = |least: bool| -> f64 {
        let of = |(x, reading): &(f64, &Reading)| {
            let [low, high] = reading.steps.map(|error| x * error);
            if least { low.min(high) } else { low.max(high) }
        };
        errors.iter().map(of).sum()
    };
    let steps = end(true).abs().max(end(false).abs());
    let times: Vec<f64> = errors.iter().filter_map(|(_, reading)| reading.sample_time).collect();
    let sample_time = times.iter().copied().fold(0.0, f64::max);
    if noise == 0.0 && steps == 0.0 {
        return None;
    }
    let debounce = asked.debounce.max(1);
    let rate = asked.false_alarms_per_hour * sample_time / 3600.0;
    let beyond = if noise > 0.0 { exp(ln(rate) / debounce as f64).min(1.0 - WITHIN) } else { 0.0 };
    let quantile = if noise > 0.0 { two_sided_normal(beyond) } else { 0.0 };
    let threshold = steps + quantile * noise;
    // All samples of the debounce are beyond it, each but for a share of what may fail.
    let margin = if noise > 0.0 { normal_quantile((1.0 - SEEN) / debounce as f64) * noise } else { 0.0 };
    Some(Threshold {
        noise,
        steps,
        threshold,
        debounce,
        sample_time,
        different_times: times.len() < errors.len() || times.iter().any(|time| *time != sample_time),
        false_alarms_per_hour: if noise > 0.0 { asked.false_alarms_per_hour } else { 0.0 },
        detection_time: debounce as f64 * sample_time,
        smallest: errors.iter().map(|(x, _)| (threshold + steps + margin) / x.abs()).collect(),
    })
}
