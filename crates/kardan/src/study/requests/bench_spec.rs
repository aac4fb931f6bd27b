//! Settings of `[bench]`.

use super::bench_truth::Truth;
use crate::study::read::read_values::{Entry, key_error, of_dimension, quantity, read_word};
use crate::study::read::scenario::whole;
use kardan_math::names::unknown_name;
use kardan_math::units::Dimension;
use kardan_model::tables::ExcitationPlan;
use kardan_model::{Document, Instance, Setting, TableReader};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::{Placed, Sign, Table};

/// The table `[bench]`, with defaults for omitted keys.
pub(in crate::study) struct BenchSpec {
    pub truth: Option<Vec<Entry>>,
    pub spread: f64,
    pub period: f64,
    pub seed: u64,
    pub plan: ExcitationPlan,
    pub parameters: Vec<Placed<String>>,
    pub signals: Vec<Placed<String>>,
    /// Shaft and speed, rad/s.
    pub speed_limits: Vec<(String, f64)>,
    /// The same, for shafts that must not creep.
    pub least_speeds: Vec<(String, f64)>,
    /// Coordinate and speed, an entry for each speed of a grid.
    pub speeds: Vec<(String, f64)>,
    pub levels: usize,
    /// `None`: the default number.
    pub points: Option<usize>,
    pub dwell: Option<f64>,
    pub ramp: f64,
    pub duration: f64,
    /// N m; zero: none.
    pub torque_noise: f64,
    /// rad/s
    pub bandwidth: f64,
}

/// Default bandwidth of the servo loops, rad/s.
const USUAL: f64 = 30.0;
/// Largest bandwidth of the servo loops times their sample time; their filter is ten times as fast.
const FASTEST: f64 = 0.3;

impl BenchSpec {
    pub fn read(document: &Document, settings: &[Setting], out: &mut Vec<Diagnostic>) -> Self {
        let table = &document.bench;
        let mut bench = BenchTable { document, reader: TableReader::new(document, settings), table, out };
        let spread = bench.number("spread", Dimension::NONE, Sign::NonNegative).unwrap_or_default();
        if spread >= 1.0 {
            let wrong = format!("{spread} would let a value change its sign");
            let help = "give a part of the values, such as 0.1";
            bench.refuse("bench::spread-range", "spread", &wrong, "not below 1", help);
        }
        let period = bench.time("sample_time").unwrap_or(1e-3); // Unreadable: the checks continue with the default.
        if !(1e-5..=0.1).contains(&period) {
            let wrong = format!("a bench cannot sample every {period} s");
            let help = "choose a time from 10 us to 0.1 s, such as \"1 ms\"";
            bench.refuse("bench::sample_time", "sample_time", &wrong, "out of range", help);
        }
        let levels = bench.count("levels", 8, (2, 50));
        let points = bench.count("points", 16, (1, 1000));
        let seed = bench.whole("seed").unwrap_or_default();
        let positive = (Sign::Positive, "write the largest speed in either direction, such as \"60 rad/s\"");
        let nonnegative =
            (Sign::NonNegative, "write the least speed in either direction, such as \"0.5 rad/s\", or \"0 rad/s\"");
        let speed_limits = bench.speeds("speed_limit", positive);
        let least_speeds = bench.speeds("least_speed", nonnegative);
        let speeds = bench.speeds("speeds", (Sign::Any, "write speeds such as \"-60 rad/s\""));
        let bandwidth = bench.number("bandwidth", Dimension::ANGULAR_VELOCITY, Sign::Positive);
        let bandwidth = bandwidth.unwrap_or(USUAL.min(FASTEST / period));
        if bandwidth * period > FASTEST * (1.0 + 1e-9) {
            let wrong = format!("servo loops of {bandwidth} rad/s cannot run every {period} s");
            let help = format!("choose at most {} rad/s, or a shorter `sample_time`", FASTEST / period);
            bench.refuse("bench::bandwidth", "bandwidth", &wrong, "too fast for the sample time", &help);
        }
        Self {
            truth: table.values.contains_key("truth").then(|| table.map("truth").unwrap_or_default().to_vec()),
            spread,
            period,
            seed,
            plan: read_word(table, "plan").and_then(ExcitationPlan::of).unwrap_or(ExcitationPlan::ConstantSpeeds),
            parameters: table.names("parameters").unwrap_or_default().to_vec(),
            signals: table.names("signals").unwrap_or_default().to_vec(),
            speed_limits,
            least_speeds,
            speeds,
            levels,
            points: table.values.contains_key("points").then_some(points),
            dwell: bench.time("dwell"),
            ramp: bench.time("ramp").unwrap_or_default(),
            duration: bench.time("duration").unwrap_or_default(),
            torque_noise: bench.number("torque_noise", Dimension::TORQUE, Sign::NonNegative).unwrap_or_default(),
            bandwidth,
        }
    }
}

const WHAT: &str = "`[bench]`";

/// The table during reading.
struct BenchTable<'a> {
    document: &'a Document,
    reader: TableReader<'a>,
    table: &'a Table,
    out: &'a mut Vec<Diagnostic>,
}

impl BenchTable<'_> {
    fn number(&mut self, key: &str, dimension: Dimension, sign: Sign) -> Option<f64> {
        quantity(&self.reader, self.table, key, (dimension, sign), WHAT, self.out).map(|value| value.to_f64())
    }

    fn time(&mut self, key: &str) -> Option<f64> {
        self.number(key, Dimension::TIME, Sign::Positive)
    }

    fn whole(&mut self, key: &str) -> Option<u64> {
        whole(&self.reader, self.table, key, WHAT, self.out)
    }

    fn count(&mut self, key: &str, default: usize, (least, most): (u64, u64)) -> usize {
        let value = self.whole(key);
        if value.is_some_and(|value| !(least..=most).contains(&value)) {
            let wrong = format!("expected a whole number from {least} to {most}");
            self.refuse("bench::number", key, &wrong, "out of range", &format!("write a number such as {default}"));
            return default;
        }
        value.map_or(default, |value| value as usize)
    }

    fn refuse(&mut self, code: &'static str, key: &str, wrong: &str, label: &str, help: &str) {
        self.out.push(key_error(code, format!("`{key}` of {WHAT}: {wrong}"), (self.table, key, label), help));
    }

    /// Speeds by shaft, rad/s.
    fn speeds(&mut self, key: &str, (sign, help): (Sign, &str)) -> Vec<(String, f64)> {
        let mut speeds = Vec::new();
        for (name, scalar) in self.table.map(key).unwrap_or_default() {
            let label = format!("`{}` in `{key}` of `[bench]`", shortened(&name.value));
            let moves = |e: &&Instance| matches!(e.kind.keyword, "shaft" | "mass");
            let bodies = || self.document.elements.iter().filter(moves);
            let Some(body) = bodies().find(|body| body.name == name.value) else {
                if !self.document.suppressed.has(&name.value) {
                    let help = unknown_name(&name.value, bodies().map(|body| body.name.as_str()));
                    self.out.push(
                        Diagnostic::error("name::unknown", format!("{label}: the model has no such shaft or mass"))
                            .at(&name.place, "not a shaft, not a mass")
                            .help(help),
                    );
                }
                continue;
            };
            let dimension = match body.kind.keyword {
                "mass" => Dimension::VELOCITY,
                _ => Dimension::ANGULAR_VELOCITY,
            };
            let read = of_dimension(&self.reader, scalar, (dimension, Sign::Any), &label, self.out);
            let Some(value) = read.map(|value| value.to_f64()) else { continue };
            let wrong = match sign {
                Sign::Positive => (value <= 0.0).then_some("must be more than zero"),
                Sign::NonNegative => (value < 0.0).then_some("must not be negative"),
                _ => None,
            };
            match wrong {
                Some(rule) => self.out.push(
                    Diagnostic::error("number::sign", format!("{label} {rule}"))
                        .at(&scalar.place, "out of range")
                        .help(help),
                ),
                None => speeds.push((name.value.clone(), value)),
            }
        }
        speeds
    }
}

/// Errors of `[bench]` itself; the planner reports those that depend on a plan.
pub(in crate::study) fn check_bench(document: &Document, settings: &[Setting], out: &mut Vec<Diagnostic>) {
    if !document.bench.values.is_empty() {
        let spec = BenchSpec::read(document, settings, out);
        if let Some(entries) = &spec.truth {
            Truth::new(document, &[]).with_values(document, settings, entries, out);
        }
    }
}
