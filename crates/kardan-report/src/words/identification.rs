//! An identification in sentences.

use super::list;
use crate::text::number;
use kardan::results::{Candidate, Found, Identification, LogRead, ResidualTest, Span, Validation};

/// How it was found, a sentence each.
pub fn head(found: &Identification) -> Vec<String> {
    let windows = &found.windows;
    let method = match found.method.as_str() {
        "steady" => format!("{} segments of constant speed", found.samples),
        _ => format!("{} windows with filtered derivatives", found.samples),
    };
    let mut out = vec![format!(
        "Torque balance of {} at {method}, windows of {} s, by least squares ({}).",
        list(&found.coordinates, 12),
        number(found.window),
        found.loss
    )];
    let mut left = Vec::new();
    for (count, why) in [
        (windows.incomplete, "lack samples of a channel"),
        (windows.resting, "have a friction at rest or of unknown sign"),
        (windows.moving, "are not steady"),
    ] {
        if count > 0 {
            left.push(format!("{count} {why}"));
        }
    }
    if windows.all > 0 {
        let rest = if left.is_empty() { String::new() } else { format!(": {}", left.join(", ")) };
        out.push(format!("{} of {} windows are used{rest}.", windows.used, windows.all));
    }
    if !found.eliminated.is_empty() {
        out.push(format!("The torques of {} are not in the logs and were eliminated.", list(&found.eliminated, 12)));
    }
    if found.outliers > 0 {
        out.push(format!("{} outliers count for nothing, or for less than a tenth.", found.outliers));
    }
    out.push(format!(
        "What is left over is {} times what the noise of the sensors explains; condition {}, {} degrees of freedom.",
        number(found.scale),
        number(found.condition),
        found.freedom
    ));
    out
}

/// A parameter as a row: name, unit, value in the file, value found, standard error, interval, published, remark.
pub fn parameter(one: &Found) -> [String; 8] {
    let optional = |x: Option<f64>| x.filter(|x| x.is_finite()).map_or("–".into(), number);
    let interval = one.interval.map_or("–".into(), |it| format!("{} … {}", number(it.lower), number(it.upper)));
    let (error, value) = (optional(one.standard_error), optional(one.value));
    [
        format!("{}{}", one.name, one.combination),
        one.unit.into(),
        optional(one.before),
        value,
        error,
        interval,
        optional(one.published),
        one.remark.clone(),
    ]
}

/// A log in one sentence.
pub fn log(log: &LogRead) -> String {
    let Span { from, until } = log.span.unwrap_or(Span { from: f64::NAN, until: f64::NAN });
    format!("{}: {} rows, {} s to {} s", log.name, log.rows, number(from), number(until))
}

/// The channels of a log as rows: channel, unit, signal, sample time, noise.
pub fn channels(log: &LogRead) -> Vec<[String; 5]> {
    log.channels
        .iter()
        .map(|one| {
            let stated = if one.stated { " (stated)" } else { "" };
            [
                one.name.clone(),
                one.unit.clone(),
                one.signal.clone(),
                format!("{} s", number(one.sample_time)),
                format!("{} {}{stated}", number(one.noise), one.si),
            ]
        })
        .collect()
}

/// A test as a row: what should hold, probability, what it means.
pub fn test(test: &ResidualTest) -> [String; 3] {
    let probability = if test.probability < 1e-4 { "below 0.0001".into() } else { format!("{:.4}", test.probability) };
    [test.what.clone(), probability, if test.meaning.is_empty() { "holds".into() } else { test.meaning.clone() }]
}

/// Validation as a row: row, torque, residual seen, residual unseen, fit.
pub fn validation(one: &Validation) -> [String; 5] {
    let unseen = one.unseen.unwrap_or(f64::NAN);
    let fit = if one.torque > 0.0 && unseen.is_finite() {
        format!("{:.2} %", 100.0 * (1.0 - unseen / one.torque))
    } else {
        "–".into()
    };
    [one.row.clone(), number(one.torque), number(one.seen), number(unseen), fit]
}

/// A candidate as a row: name, parameters, error, verdict.
pub fn candidate(one: &Candidate) -> [String; 4] {
    let error = match one.error {
        Some(error) if error.mean.is_finite() => format!("{} ± {}", number(error.mean), number(error.spread)),
        _ => "–".into(),
    };
    let verdict = match (one.chosen, one.failure.as_str()) {
        (true, _) => "simplest within one standard error of the best".into(),
        (_, why) => why.to_string(),
    };
    [one.name.clone(), one.parameters.join(", "), error, verdict]
}
