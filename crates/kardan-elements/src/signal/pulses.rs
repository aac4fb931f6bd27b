//! The signal `pulses`: a train of pulses.

use super::writer::times;
use super::{Refused, SignalKind, SignalWriter};
use crate::element::KeyError;
use kardan_expr::expr::Expr;
use kardan_math::units::{Dimension, Exact};
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// A train of pulses.
    signal Pulses("pulses") {
        required {
            high: AnyQuantity, "Value during a pulse; its unit is that of the signal.";
            period: Quantity(Dimension::TIME, Sign::Period), "Time from one pulse to the next.";
            width: Quantity(Dimension::TIME, Sign::Positive), "How long a pulse lasts, less than the period.";
        }
        optional {
            low: AnyQuantity, "Value between pulses, and before the start; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When the first pulse begins.";
            count: Number(Sign::Positive), "Number of pulses, a whole number; left out: up to the end of the run.";
        }
    }
}

pub(super) const PULSES: SignalKind = SignalKind {
    keyword: Pulses::KEYWORD,
    summary: "A train of pulses, steps at exact times.",
    formula: "high from start + k period for the width, for k = 0, 1, 2 ...; else low.",
    fields: Pulses::FIELDS,
    example: "\
[signal.knocks]
kind = \"pulses\"
high = \"5 N m\"
period = \"0.2 s\"
width = \"10 ms\"
start = \"0.1 s\"
count = 3
",
    check,
    write,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = Vec::new();
    if let (Some(width), Some(period)) = (values.number("width"), values.number("period"))
        && width >= period
    {
        let message = format!("a pulse of {width} s does not end before the next one begins, after {period} s");
        out.push(KeyError::new("width", message, "make `width` less than `period`"));
    }
    if let Some(count) = values.number("count").filter(|count| count.fract() != 0.0) {
        out.push(KeyError::new(
            "count",
            format!("expected a whole number of pulses, found {count}"),
            "write a number such as 3",
        ));
    }
    out
}

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [low, high] = ["low", "high"].map(|key| values.number_or_default(key));
    let [start, period, width] = ["start", "period", "width"].map(|key| values.exact_or_default(key));
    let end = Exact::new(start.to_rational() + width.to_rational(), 0);
    let level = |level: f64| [level, 0.0, 0.0, 0.0];
    let pulse = move |(begin, end): (f64, f64)| [(begin, level(high)), (end, level(low))];
    let count = values.number("count").map_or(usize::MAX, |count| count as usize);
    let pulses = times(&start, &period).zip(times(&end, &period)).take(count).flat_map(pulse);
    // Before the run: not a reported step.
    let before = (!start.is_zero()).then_some((-1.0, level(low)));
    let about = (writer.dimension, true);
    writer.pieces("", about, before.into_iter().chain(pulses))
}
