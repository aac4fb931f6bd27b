//! Alarm thresholds of residuals: the effect of sensor noise and quantisation, at one instant or in time through a filter.

use crate::study::PreparedVariant;
use crate::study::operating_point::working_point::ParitySettings;
use kardan_analysis::OutputSignal;
use kardan_identify::{normal_quantile, two_sided_normal};
use kardan_mechanics::equations::Measured;
use kardan_results::Threshold;
use kardan_results::signal_name::SignalName;
use kardan_rt::functions::{exp, hypot, ln};
use kardan_simulate::signal_names;
use std::collections::VecDeque;

/// The errors of a sensor reading.
pub(in crate::study) struct Reading {
    pub unit: String,
    /// Standard deviation of its noise.
    noise: f64,
    /// The smallest and the largest error of its quantisation.
    steps: [f64; 2],
    /// Its sample time, s; none for a signal that is read unchanged.
    pub sample_time: Option<f64>,
}

/// The errors of the sensors of these outputs; other signals are read unchanged.
pub(in crate::study) fn readings(variant: &PreparedVariant, outputs: &[OutputSignal]) -> Vec<Reading> {
    let equations = &variant.reduced.equations;
    let declared_signals = signal_names(&variant.reduced, &variant.scenario);
    let one = |output: &OutputSignal| {
        let named = |name: &String| *name == output.name || SignalName::new(name).element == output.name;
        let unit = declared_signals
            .iter()
            .find(|(name, _)| named(name))
            .map_or("", |(_, physical)| physical.unit())
            .to_string();
        let sensor = equations.sensors.iter().find(|(name, _)| *name == output.name).map(|(_, sensor)| sensor);
        let Some(sensor) = sensor else { return Reading { unit, noise: 0.0, steps: [0.0; 2], sample_time: None } };
        let sample_time = sensor.sample_time.as_ref().map(kardan_math::units::Exact::to_f64);
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

/// The probability that a change is detected.
const DETECTION_PROBABILITY: f64 = 0.999;

/// The least probability that one sample is within the threshold.
const LEAST_INSIDE: f64 = 0.7;

/// The number of samples of a filter, in time constants and orders, after which a pulse has decayed to 12 digits.
const FORGOTTEN: usize = 15;

/// The effect of one of its signals on a residual.
pub(in crate::study) struct Part<'a> {
    /// The errors of the signal's sensor; `None` for a command, which is known exactly.
    pub reading: Option<&'a Reading>,
    /// The response of the residual to a pulse of the signal of one sample; one number at one instant.
    pub pulse: Vec<f64>,
}

impl Part<'_> {
    /// Standard deviation of the residual from its noise.
    fn noise(&self) -> f64 {
        let gain = self.pulse.iter().map(|x| x * x).sum::<f64>().sqrt();
        self.reading.map_or(0.0, |reading| gain * reading.noise)
    }

    /// The least or largest effect of its quantisation on the residual, for any errors in each sample.
    fn steps(&self, least: bool) -> f64 {
        let Some(reading) = self.reading else { return 0.0 };
        let of = |x: &f64| {
            let [low, high] = reading.steps.map(|error| x * error);
            if least { low.min(high) } else { low.max(high) }
        };
        self.pulse.iter().map(of).sum()
    }

    /// A change of one, from some sample on: the least of its effect in this number of consecutive samples, where that is largest (within one hundredth), and
    /// how many samples later the last one of these is.
    fn change(&self, samples: usize) -> (f64, usize) {
        let sums: Vec<f64> = self
            .pulse
            .iter()
            .scan(0.0, |sum, x| {
                *sum += x;
                Some(f64::abs(*sum))
            })
            .collect();
        let least = least_of_each(&sums, samples);
        let most = least.iter().copied().fold(0.0, f64::max);
        let first = least.iter().position(|size| *size >= ALMOST * most).unwrap_or(0);
        (least.get(first).copied().unwrap_or(0.0), first + samples)
    }
}

/// The minimum of this number of values, from each one on; after the last one all are equal to it. In one pass, for any number.
fn least_of_each(numbers: &[f64], count: usize) -> Vec<f64> {
    let mut out = vec![0.0; numbers.len()];
    // From the end: values below all values between them and here, the nearest last.
    let mut nearest: VecDeque<usize> = VecDeque::new();
    for k in (0..numbers.len()).rev() {
        while nearest.back().is_some_and(|later| numbers[*later] >= numbers[k]) {
            nearest.pop_back();
        }
        nearest.push_back(k);
        while nearest.front().is_some_and(|far| *far >= k + count) {
            nearest.pop_front();
        }
        out[k] = nearest.front().map_or(0.0, |least| numbers[*least]);
    }
    out
}

/// Fraction of the largest effect of a change above which it counts as the largest.
const ALMOST: f64 = 0.99;

/// The response to a pulse of one sample of `Σ c sᵈ / (τ s + 1)ⁿ`, terms `(d, c)` with d ≤ n, by the bilinear rule `s = (2/h)(z − 1)/(z + 1)` as
/// in `kind = "transfer_function"`; until it has decayed to 12 digits.
pub(in crate::study) fn pulse(terms: &[(usize, f64)], order: usize, time: f64, sample_time: f64) -> Vec<f64> {
    let turns = 2.0 * time / sample_time;
    let length = FORGOTTEN * (order + 2) * (0.5 * turns + 1.0).ceil() as usize;
    let mut out = vec![0.0; length];
    for (derivative, factor) in terms {
        let mut signal = vec![0.0; length];
        signal[0] = *factor;
        for section in 0..order {
            let [now, last] = if section < *derivative { [1.0, -1.0].map(|x| x * 2.0 / sample_time) } else { [1.0; 2] };
            let (mut before, mut filtered) = (0.0, 0.0);
            for x in &mut signal {
                filtered = ((turns - 1.0) * filtered + now * *x + last * before) / (turns + 1.0);
                before = std::mem::replace(x, filtered);
            }
        }
        out.iter_mut().zip(signal).for_each(|(sum, x)| *sum += x);
    }
    out
}

/// The threshold of a residual; `None` if nothing disturbs it.
///
/// With white Gaussian noise of standard deviation σ and an error b of all steps, a sample lies beyond `b + zσ` with at most the probability
/// p of a normal number beyond ±z, and an alarm begins at a sample with at most pᴺ, N the samples of the debounce; behind a filter, where noise is no
/// longer white, with at most p; `filter`: its time constant and its sample time, s. `detected_parts`: the parts for which the smallest detectable change is computed; the time of detection is their longest.
pub(in crate::study) fn threshold(
    parts: &[Part<'_>],
    detected_parts: &[usize],
    options: &ParitySettings,
    filter: Option<(f64, f64)>,
) -> Option<Threshold> {
    let noise = parts.iter().map(Part::noise).fold(0.0, hypot);
    let end = |least: bool| parts.iter().map(|part| part.steps(least)).sum::<f64>();
    let steps = end(true).abs().max(end(false).abs());
    let readings = || parts.iter().filter_map(|part| part.reading);
    let times: Vec<f64> = readings().filter_map(|reading| reading.sample_time).collect();
    let sample_time = filter.map_or_else(|| times.iter().copied().fold(0.0, f64::max), |(_, sample_time)| sample_time);
    // Signals that are read at every instant are newer than sampled ones.
    let beside = !times.is_empty() && times.len() < readings().count();
    if noise == 0.0 && steps == 0.0 {
        return None;
    }
    let debounce = options.debounce.max(1);
    let rate = options.false_alarms_per_hour * sample_time / 3600.0;
    let independent = if filter.is_none() { debounce } else { 1 };
    let beyond = if noise > 0.0 { exp(ln(rate) / independent as f64).min(1.0 - LEAST_INSIDE) } else { 0.0 };
    let quantile = if noise > 0.0 { two_sided_normal(beyond) } else { 0.0 };
    let threshold = steps + quantile * noise;
    // All samples of the debounce are beyond it, each with its part of the failure probability.
    let margin =
        if noise > 0.0 { normal_quantile((1.0 - DETECTION_PROBABILITY) / debounce as f64) * noise } else { 0.0 };
    let changes: Vec<(f64, usize)> = detected_parts.iter().map(|k| parts[*k].change(debounce)).collect();
    Some(Threshold {
        noise,
        steps,
        threshold,
        debounce,
        sample_time,
        multirate: beside || times.iter().any(|time| *time != sample_time),
        false_alarms_per_hour: if noise > 0.0 { options.false_alarms_per_hour } else { 0.0 },
        detection_time: changes.iter().map(|(_, samples)| *samples).max().unwrap_or(debounce) as f64 * sample_time,
        min_detectable: changes.iter().map(|(size, _)| (threshold + steps + margin) / size).collect(),
        filter: filter.map(|(time, _)| time),
    })
}

#[cfg(test)]
#[path = "../../../tests/unit/study/analyze/thresholds.rs"]
mod tests;
