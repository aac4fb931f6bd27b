//! A bound on a signal, and whether a run keeps it.

use kardan_rt::functions::powi;

use crate::model::tables::Measure;
use crate::names::{Quantity, SignalName};
use crate::results::{DisplayUnit, MotorStrain, RequirementResult, Series};

/// A bound on a signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Signal.
    pub signal: String,
    /// What is measured of it.
    pub measure: Measure,
    /// The unit of its bounds in the file, where it is not the SI unit.
    pub display: Option<DisplayUnit>,
    /// Bound from above, SI.
    pub below: Option<f64>,
    /// Bound from below, SI.
    pub above: Option<f64>,
    /// Window, s.
    pub from: f64,
    /// Window, s.
    pub until: f64,
    /// Variants that it applies to; empty: all.
    pub variants: Vec<String>,
}

pub(super) fn judge(
    requirement: &Requirement,
    series: &Series,
    strains: &[MotorStrain],
    completed: bool,
) -> RequirementResult {
    let Requirement { signal, measure, display, below, above, from, until, .. } = requirement;
    let found = series.signal(signal);
    let unit = match measure {
        Measure::TimeAtLimit => "s".to_string(),
        _ => found.map_or("", |signal| signal.physical.unit()).to_string(),
    };
    let values = found.map(|signal| signal.values.as_slice()).unwrap_or_default();
    let rows = series.time.iter().zip(values).filter(|(time, _)| (*from..=*until).contains(*time));
    let (times, window): (Vec<f64>, Vec<f64>) = rows.map(|(time, value)| (*time, *value)).unzip();
    let measured = match measure {
        _ if window.is_empty() => None,
        Measure::Max => Some(window.iter().copied().fold(f64::NEG_INFINITY, f64::max)),
        Measure::Min => Some(window.iter().copied().fold(f64::INFINITY, f64::min)),
        Measure::MaxAbs => Some(window.iter().fold(0.0, |max: f64, x| max.max(x.abs()))),
        Measure::TimeAtLimit => {
            let strain = strains.iter().find(|strain| motor_of(signal) == Some(strain.motor.as_str()));
            strain.map(|strain| strain.seconds_at_limit(*from, *until))
        }
        Measure::Rms => Some(root_mean_square(&times, &window, 0.0)),
        Measure::Ripple => Some(root_mean_square(&times, &window, mean(&times, &window))),
        Measure::Final => window.last().copied(),
    };
    // A run that ended inside the window cannot pass: nobody knows what would have come.
    let complete = completed || series.time.last().is_some_and(|last| last >= until);
    let passed = complete
        && below.is_none_or(|bound| measured.is_some_and(|measured| measured < bound))
        && above.is_none_or(|bound| measured.is_some_and(|measured| measured > bound));
    let name = match measure {
        Measure::MaxAbs => format!("max |{signal}|"),
        Measure::TimeAtLimit => format!("time of {} at its torque limit", motor_of(signal).unwrap_or(signal)),
        _ => format!("{} {signal}", measure.word()),
    };
    let window = if *from > 0.0 || until.is_finite() {
        let end = if until.is_finite() { format!("{until} s") } else { "the end".to_string() };
        format!(" from {from} s to {end}")
    } else {
        String::new()
    };
    let told = display.as_ref().map_or(unit.as_str(), |display| &display.unit);
    let bound = |bound: &Option<f64>| bound.map(|bound| display.as_ref().map_or(bound, |unit| written(bound, unit)));
    let text = match (bound(above), bound(below)) {
        (Some(above), Some(below)) => format!("{above} < {name}{window} < {below} {told}"),
        (Some(above), None) => format!("{name}{window} > {above} {told}"),
        (None, Some(below)) => format!("{name}{window} < {below} {told}"),
        (None, None) => format!("{name}{window}"),
    };
    RequirementResult { text, measured, unit, display: display.clone(), passed }
}

/// A bound in the unit of the file, without the digits that the change of units rounded: 15 remain.
fn written(bound: f64, unit: &DisplayUnit) -> f64 {
    let value = unit.of(bound);
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// The motor of which a signal is the torque.
pub(super) fn motor_of(signal: &str) -> Option<&str> {
    let name = SignalName::new(signal);
    name.alone().filter(|_| matches!(name.quantity(), Some(Quantity::Torque | Quantity::Force | Quantity::Command)))
}

/// The mean over the time of values that lie on straight lines between the rows; of one row its value.
fn mean(times: &[f64], values: &[f64]) -> f64 {
    let length = times.last().zip(times.first()).map_or(0.0, |(last, first)| last - first);
    if length <= 0.0 {
        return values.iter().sum::<f64>() / values.len() as f64;
    }
    let pieces = times.windows(2).zip(values.windows(2));
    pieces.map(|(t, x)| 0.5 * (x[0] + x[1]) * (t[1] - t[0])).sum::<f64>() / length
}

/// The root of the mean over the time of `(x − around)²`; rows may lie closer to each other where something happens.
fn root_mean_square(times: &[f64], values: &[f64], around: f64) -> f64 {
    let squares: Vec<f64> = values.iter().map(|x| powi(x - around, 2)).collect();
    mean(times, &squares).sqrt()
}
