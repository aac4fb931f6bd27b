//! What `[bench]` asks for.

use super::truth::{Entry, Truth};
use crate::diagnostics::{Diagnostic, shortened};
use crate::model::tables::ExcitationPlan;
use crate::model::{Document, Setting, TableReader};
use crate::names::unknown_name;
use crate::schema::{Placed, Sign, Table, Value};
use crate::study::read::{of_dimension, quantity, read_word, read_words};
use crate::study::scenario::whole;
use crate::units::Dimension;

/// The table `[bench]` with what holds for keys that are left out.
pub(super) struct Spec {
    pub truth: Option<Vec<Entry>>,
    pub spread: f64,
    pub period: f64,
    pub seed: u64,
    pub plan: ExcitationPlan,
    pub parameters: Vec<Placed<String>>,
    pub signals: Vec<Placed<String>>,
    /// Shaft and speed, rad/s.
    pub speed_limits: Vec<(String, f64)>,
    /// The same, of those that are not to creep.
    pub least_speeds: Vec<(String, f64)>,
    /// Coordinate and speed, an entry for each speed of a grid.
    pub speeds: Vec<(String, f64)>,
    pub levels: usize,
    /// `None`: as many as usual.
    pub points: Option<usize>,
    pub dwell: Option<f64>,
    pub ramp: f64,
    pub duration: f64,
    /// N m; zero: none.
    pub torque_noise: f64,
    /// rad/s
    pub bandwidth: f64,
}

/// Bandwidth of the servo loops that have no other, rad/s.
const USUAL: f64 = 30.0;
/// Largest bandwidth of the servo loops times their sample time; their filter is ten times as fast.
const FASTEST: f64 = 0.3;

/// The entries of a table of names and quantities.
pub(super) fn entries(table: &Table, key: &str) -> Option<Vec<Entry>> {
    match table.values.get(key).map(|spanned| &spanned.value) {
        Some(Value::Map(entries)) => Some(entries.clone()),
        _ => None,
    }
}

impl Spec {
    pub fn read(document: &Document, settings: &[Setting], out: &mut Vec<Diagnostic>) -> Self {
        let (reader, table, what) = (TableReader::new(document, settings), &document.bench, "`[bench]`");
        let number = |key: &str, dimension, sign, out: &mut Vec<Diagnostic>| {
            quantity(&reader, table, key, (dimension, sign), what, out).map(|value| value.to_f64())
        };
        let time = |key: &str, out: &mut Vec<Diagnostic>| number(key, Dimension::TIME, Sign::Positive, out);
        let spread = number("spread", Dimension::NONE, Sign::NonNegative, out).unwrap_or_default();
        if spread >= 1.0 {
            out.push(
                Diagnostic::error(
                    "bench::spread",
                    format!("`spread` of {what}: {spread} would let a value change its sign"),
                )
                .at(TableReader::place(table, "spread"), "not below 1")
                .help("give a part of the values, such as 0.1"),
            );
        }
        let period = time("sample_time", out).unwrap_or(1e-3); // Unreadable: checked on with a usual one.
        if !(1e-5..=0.1).contains(&period) {
            out.push(
                Diagnostic::error(
                    "bench::sample_time",
                    format!("`sample_time` of {what}: a bench cannot sample every {period} s"),
                )
                .at(TableReader::place(table, "sample_time"), "out of range")
                .help("choose a time from 10 us to 0.1 s, such as \"1 ms\""),
            );
        }
        let mut count = |key: &str, default: usize, (least, most): (u64, u64)| {
            let value = whole(&reader, table, key, what, out);
            if value.is_some_and(|value| !(least..=most).contains(&value)) {
                out.push(
                    Diagnostic::error(
                        "bench::number",
                        format!("`{key}` of {what}: expected a whole number from {least} to {most}"),
                    )
                    .at(TableReader::place(table, key), "out of range")
                    .help(format!("write a number such as {default}")),
                );
                return default;
            }
            value.map_or(default, |value| value as usize)
        };
        let (levels, points) = (count("levels", 8, (2, 50)), count("points", 16, (1, 1000)));
        let seed = whole(&reader, table, "seed", what, out).unwrap_or_default();
        let positive = (Sign::Positive, "write the largest speed either way, such as \"60 rad/s\"");
        let nonnegative =
            (Sign::NonNegative, "write the least speed either way, such as \"0.5 rad/s\", or \"0 rad/s\"");
        let any = (Sign::Any, "write speeds such as \"-60 rad/s\"");
        let speed_limits = speeds(document, &reader, "speed_limit", positive, out);
        let least_speeds = speeds(document, &reader, "least_speed", nonnegative, out);
        let grid = speeds(document, &reader, "speeds", any, out);
        let bandwidth = number("bandwidth", Dimension::ANGULAR_VELOCITY, Sign::Positive, out);
        let bandwidth = bandwidth.unwrap_or(USUAL.min(FASTEST / period));
        if bandwidth * period > FASTEST * (1.0 + 1e-9) {
            out.push(
                Diagnostic::error(
                    "bench::bandwidth",
                    format!("`bandwidth` of {what}: servo loops of {bandwidth} rad/s cannot run every {period} s"),
                )
                .at(TableReader::place(table, "bandwidth"), "too fast for the sample time")
                .help(format!("choose at most {} rad/s, or a shorter `sample_time`", FASTEST / period)),
            );
        }
        Self {
            truth: entries(table, "truth"),
            spread,
            period,
            seed,
            plan: read_word(table, "plan").and_then(ExcitationPlan::of).unwrap_or(ExcitationPlan::ConstantSpeeds),
            parameters: read_words(table, "parameters").to_vec(),
            signals: read_words(table, "signals").to_vec(),
            speed_limits,
            least_speeds,
            speeds: grid,
            levels,
            points: table.values.contains_key("points").then_some(points),
            dwell: time("dwell", out),
            ramp: time("ramp", out).unwrap_or_default(),
            duration: time("duration", out).unwrap_or_default(),
            torque_noise: number("torque_noise", Dimension::TORQUE, Sign::NonNegative, out).unwrap_or_default(),
            bandwidth,
        }
    }
}

/// Speeds by shaft, rad/s.
fn speeds(
    document: &Document,
    reader: &TableReader<'_>,
    key: &str,
    (sign, help): (Sign, &str),
    out: &mut Vec<Diagnostic>,
) -> Vec<(String, f64)> {
    let mut found = Vec::new();
    for (name, scalar) in entries(&document.bench, key).unwrap_or_default() {
        let label = format!("`{}` in `{key}` of `[bench]`", shortened(&name.value));
        let shafts = || document.elements.iter().filter(|e| e.kind.keyword == "shaft").map(|e| e.name.as_str());
        if !shafts().any(|shaft| shaft == name.value) {
            if !document.doubts.has(&name.value) {
                let help = unknown_name(&name.value, shafts());
                out.push(
                    Diagnostic::error("name::unknown", format!("{label}: there is no such shaft"))
                        .at(name.place.clone(), "not a shaft")
                        .help(help),
                );
            }
            continue;
        }
        let read = of_dimension(reader, &scalar, (Dimension::ANGULAR_VELOCITY, Sign::Any), &label, out);
        let Some(value) = read.map(|value| value.to_f64()) else { continue };
        let wrong = match sign {
            Sign::Positive => (value <= 0.0).then_some("must be more than zero"),
            Sign::NonNegative => (value < 0.0).then_some("must not be negative"),
            _ => None,
        };
        match wrong {
            Some(rule) => out.push(
                Diagnostic::error("number::sign", format!("{label} {rule}"))
                    .at(scalar.place.clone(), "out of range")
                    .help(help),
            ),
            None => found.push((name.value, value)),
        }
    }
    found
}

/// What is wrong with `[bench]` itself; what depends on a plan is found where one is made.
pub(in crate::study) fn check(document: &Document, settings: &[Setting], out: &mut Vec<Diagnostic>) {
    if !document.bench.values.is_empty() {
        let spec = Spec::read(document, settings, out);
        if let Some(entries) = &spec.truth {
            Truth::new(document, &[]).given(document, settings, entries, out);
        }
    }
}
