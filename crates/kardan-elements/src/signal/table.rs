//! The signal `table`: values over time, from a file or listed.

use super::{Refused, Samples, SignalKind, SignalWriter};
use crate::element::KeyError;
use kardan_expr::expr::Expr;
use kardan_math::num::steffen;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// Values over time, from a file or listed.
    signal TableSignal("table") {
        optional {
            points: Lists,
                "The points: `{ time = [\"0 s\", \"1 s\"], value = [\"0 N m\", \"2 N m\"] }`; left out: those of a file.";
            file: Text,
                "A log with the points (CSV, Parquet, MAT or MDF 4), by its path from the folder of the model file.";
            time: Text, "The column of the time; left out: the one that the file marks, or the one named time or t.";
            column: Text, "The column of the values; left out: the only one besides the time.";
            unit: Text, "Unit of the values in the file, `deg`; left out: that of the file.";
            time_unit: Text, "Unit of the time; left out: that of the file, else s.";
            interpolation: Choice(&["linear", "cubic", "hold"]) = "linear",
                "Between two points: a straight line, a cubic that is as monotone as the points are (Steffen, Astron. Astrophys. 239, \
                 1990), or the value of the earlier one.";
            extrapolation: Choice(&["error", "hold", "repeat"]) = "error",
                "For times before the first or after the last point: kardan rejects the run, the value of that point is held, or the table is \
                 repeated.";
            delay: Quantity(Dimension::TIME, Sign::Any) = "0 s", "Offset added to the times.";
        }
    }
}

pub(super) const TABLE: SignalKind = SignalKind {
    keyword: TableSignal::KEYWORD,
    summary: "Values over time: from a log, or listed in the model.",
    formula: "Interpolated between the points by `interpolation`; outside them by `extrapolation`.",
    fields: TableSignal::FIELDS,
    example: "\
[signal.road]
kind = \"table\"
points = { time = [\"0 s\", \"0.5 s\", \"2 s\"], value = [\"0 N m\", \"4 N m\", \"1 N m\"] }
interpolation = \"cubic\"
extrapolation = \"hold\"
",
    check,
    write,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    match (values.has("points"), values.has("file")) {
        (true, true) => out.push(KeyError::new("points", "there are points and a file", "remove one of the two")),
        (false, false) => {
            out.push(KeyError::new("kind", "there are neither points nor a file", "add `points` or `file`"))
        }
        _ => {}
    }
    let of_file = ["time", "column", "unit", "time_unit"];
    if let Some(key) = of_file.iter().find(|key| values.has("points") && values.has(key)) {
        out.push(KeyError::new(key, format!("`{key}` is for a file, but there are points"), "remove it"));
    }
    out
}

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let key = if values.has("file") { "file" } else { "points" };
    let refused = |code, message: String, help: &str| Refused::new(code, key, message, help);
    let Some(Samples { times, values: samples }) = writer.samples else {
        return Err(refused("signal::points", "there are no points".into(), "add some"));
    };
    let delay = values.number_or_default("delay");
    let times: Vec<f64> = times.iter().map(|time| time + delay).collect();
    if times.len() != samples.len() || times.is_empty() {
        let message = format!("there are {} times and {} values", times.len(), samples.len());
        return Err(refused("signal::points", message, "give one value for each time"));
    }
    let all = || times.iter().chain(samples);
    if let Some(k) = all().position(|x| !x.is_finite()) {
        let (row, what) = (k % times.len(), if k < times.len() { "time" } else { "value" });
        let message = format!("the {what} of point {} is not a number", row + 1);
        return Err(refused(
            "signal::points",
            message,
            "every point needs a time and a value: is a cell empty, or a row too short?",
        ));
    }
    if let Some(k) = times.windows(2).position(|pair| pair[0] >= pair[1]) {
        let message = format!("the times do not increase: {} s after {} s (point {})", times[k + 1], times[k], k + 2);
        return Err(refused("signal::order", message, "sort the points by time, and keep one for each time"));
    }
    let (first, last) = (times[0], times[times.len() - 1]);
    let extrapolation = values.word_or_default("extrapolation");
    if extrapolation == "error" && (first > 0.0 || last < writer.horizon) {
        let message = format!("the points are from {first} s to {last} s, the run is from 0 s to {} s", writer.horizon);
        let help = "define the values outside them by `extrapolation = \"hold\"` or `extrapolation = \"repeat\"`";
        return Err(refused("signal::extrapolation", message, help));
    }
    let mut pieces = between(&times, samples, values.word_or_default("interpolation"));
    let level = |value: f64| [value, 0.0, 0.0, 0.0];
    if extrapolation == "repeat" && times.len() > 1 {
        let period = last - first;
        let before = (first / period).ceil();
        let round = move |k: usize| {
            let shift = (k as f64 - before) * period;
            pieces.clone().into_iter().map(move |(start, coefficients)| (start + shift, coefficients))
        };
        let all = (0..).flat_map(round);
        return writer.pieces("", (writer.dimension, false), from_zero(all));
    }
    pieces.push((last, level(samples[samples.len() - 1])));
    let before = (first > 0.0).then_some((0.0, level(samples[0])));
    writer.pieces("", (writer.dimension, false), from_zero(before.into_iter().chain(pieces)))
}

/// Pieces without those that end before time zero.
fn from_zero(pieces: impl Iterator<Item = (f64, [f64; 4])>) -> impl Iterator<Item = (f64, [f64; 4])> {
    let mut pieces = pieces.peekable();
    std::iter::from_fn(move || {
        loop {
            let piece = pieces.next()?;
            if pieces.peek().is_none_or(|(start, _)| *start > 0.0) {
                return Some(piece);
            }
        }
    })
}

/// The pieces between points.
fn between(times: &[f64], values: &[f64], interpolation: &str) -> Vec<(f64, [f64; 4])> {
    let count = times.len();
    let secant = |k: usize| (values[k + 1] - values[k]) / (times[k + 1] - times[k]);
    if interpolation != "cubic" || count < 3 {
        let slope = |k: usize| if interpolation == "hold" { 0.0 } else { secant(k) };
        return (0..count - 1).map(|k| (times[k], [values[k], slope(k), 0.0, 0.0])).collect();
    }
    let slopes = steffen(times, values);
    let piece = |k: usize| {
        let (h, s) = (times[k + 1] - times[k], secant(k));
        let c = (3.0 * s - 2.0 * slopes[k] - slopes[k + 1]) / h;
        let d = (slopes[k] + slopes[k + 1] - 2.0 * s) / (h * h);
        (times[k], [values[k], slopes[k], c, d])
    };
    (0..count - 1).map(piece).collect()
}

#[cfg(test)]
#[path = "../../tests/unit/signal/table.rs"]
mod tests;
