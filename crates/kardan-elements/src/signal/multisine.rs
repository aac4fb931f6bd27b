//! The signal `multisine`: a sum of sines.

use super::{Refused, SignalKind, SignalWriter};
use crate::element::KeyError;
use kardan_expr::expr::{Expr, Function};
use kardan_math::num::Rational;
use kardan_math::units::{Dimension, Exact};
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

/// Lines of a multisine.
const MOST_LINES: f64 = 1000.0;

keys! {
    /// A sum of sines.
    signal Multisine("multisine") {
        optional {
            line: Tables(MultisineLine), "Its sines: `[[signal.NAME.line]]`; left out: `count` of them in a band.";
            amplitude: AnyQuantity, "Amplitude of each sine of the band; its unit is that of the signal.";
            from: Quantity(Dimension::FREQUENCY, Sign::Positive), "Lowest frequency of the band.";
            to: Quantity(Dimension::FREQUENCY, Sign::Positive), "Highest frequency of the band.";
            count: Number(Sign::Positive), "Sines in the band, a whole number from 2 to 1000, evenly spaced.";
            offset: AnyQuantity, "Added offset, which is the value before the start; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

keys! {
    /// `[[signal.<name>.line]]`.
    table MultisineLine {
        required {
            amplitude: AnyQuantity, "Amplitude of this sine.";
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive), "Its frequency.";
        }
        optional {
            phase: Quantity(Dimension::ANGLE, Sign::Any) = "0 rad", "Its phase at the start.";
        }
    }
}

pub(super) const MULTISINE: SignalKind = SignalKind {
    keyword: Multisine::KEYWORD,
    summary: "A sum of sines: those listed, or evenly spaced ones of a band with Schroeder phases, for low peaks.",
    formula: "offset + sum of amplitude sin(2 pi frequency (t - start) + phase); of a band of N sines number k, from 0,\n\
              has the phase -pi k (k + 1)/N (Schroeder, IEEE Trans. Inf. Theory 16, 1970); before the start: offset.",
    fields: Multisine::FIELDS,
    example: "\
[signal.shake]
kind = \"multisine\"
amplitude = \"0.2 N m\"
from = \"1 Hz\"
to = \"20 Hz\"
count = 20
",
    check,
    write,
};

fn check(values: &Values) -> Vec<KeyError> {
    let band = ["amplitude", "from", "to", "count"];
    let missing = band.iter().find(|key| !values.has(key));
    let listed = values.tables("line").is_some();
    let mut out = Vec::new();
    if let (Some(key), true) = (band.iter().find(|key| values.has(key)), listed) {
        let message = format!("`{key}` belongs to a band, but the sines are listed by `line`");
        out.push(KeyError::new(key, message, "remove one of the two"));
    }
    if let (Some(key), false) = (missing, listed) {
        let message = format!("a band needs `amplitude`, `from`, `to` and `count`; `{key}` is missing");
        out.push(KeyError::new("kind", message, "add it, or list the sines by `[[signal.NAME.line]]`"));
    }
    if let Some(count) = values.number("count").filter(|n| n.fract() != 0.0 || !(2.0..=MOST_LINES).contains(n)) {
        let message = format!("expected a whole number of sines from 2 to {MOST_LINES}, found {count}");
        out.push(KeyError::new("count", message, "write a number such as 20"));
    }
    if let (Some(from), Some(to)) = (values.number("from"), values.number("to"))
        && from >= to
    {
        out.push(KeyError::new(
            "to",
            format!("the band ends at {to} Hz, not above its start at {from} Hz"),
            "increase `to`",
        ));
    }
    out
}

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let (on, clock) = writer.clock(&values.exact_or_default("start"), None)?;
    let line = |line: &Values| ["amplitude", "frequency", "phase"].map(|key| line.exact_or_default(key));
    let lines: Vec<[Exact; 3]> = match values.tables("line") {
        Some(lines) => lines.iter().map(line).collect(),
        None => band(values),
    };
    let mut terms = Vec::new();
    for [amplitude, frequency, phase] in &lines {
        let [amplitude, frequency] = [amplitude, frequency].map(|value| writer.exact(value));
        let waves = writer.graph.multiply(frequency, clock);
        let angle = writer.turns(waves, phase);
        let angle = writer.graph.group(angle);
        let sine = writer.graph.apply(Function::Sin, angle);
        terms.push((writer.graph.multiply(amplitude, sine), Rational::ONE));
    }
    let offset = writer.exact(&values.exact_or_default("offset"));
    let sum = writer.graph.sum(Rational::ZERO, &terms);
    let sum = writer.graph.multiply(on, sum);
    Ok(writer.graph.add(offset, sum))
}

/// Amplitude, frequency and phase of the sines of a band.
fn band(values: &Values) -> Vec<[Exact; 3]> {
    let count = values.number_or_default("count").min(MOST_LINES) as i64;
    let [from, to] = ["from", "to"].map(|key| values.exact_or_default(key).to_rational());
    let step = (to - &from) / Rational::from((count - 1).max(1));
    let line = |k: i64| {
        let frequency = Exact::new(&from + &step * Rational::from(k), 0);
        // -pi k (k + 1)/N modulo whole revolutions.
        let half_turns = -(k * (k + 1)) % (2 * count);
        let phase = Exact::new(Rational::from(half_turns) / Rational::from(count), 1);
        [values.exact_or_default("amplitude"), frequency, phase]
    };
    (0..count).map(line).collect()
}
