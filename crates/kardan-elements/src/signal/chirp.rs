//! The signal `chirp`: a sine with changing frequency.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::{Expr, Function};
use kardan_math::num::Rational;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// A sine whose frequency changes.
    signal Chirp("chirp") {
        required {
            amplitude: AnyQuantity, "Largest deviation from the offset; its unit is that of the signal.";
            from: Quantity(Dimension::FREQUENCY, Sign::Positive), "Frequency at the start, `1 Hz`.";
            to: Quantity(Dimension::FREQUENCY, Sign::Positive), "Frequency at the end.";
            over: Quantity(Dimension::TIME, Sign::Positive), "Duration of the sweep.";
        }
        optional {
            sweep: Choice(&["linear", "logarithmic"]) = "linear",
                "How the frequency grows: by the same amount in each second, or by the same factor.";
            phase: Quantity(Dimension::ANGLE, Sign::Any) = "0 rad", "Phase at the start.";
            offset: AnyQuantity, "Added offset, which is the value before the start and after the end; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const CHIRP: SignalKind = SignalKind {
    keyword: Chirp::KEYWORD,
    summary: "A sine whose frequency goes from one value to another.",
    formula: "offset + amplitude sin(2 pi n + phase) with x = t - start and\n\
              linear: n = from x + (to - from) x^2/(2 over); logarithmic: n = from over ((to/from)^(x/over) - 1)/ln(to/from);\n\
              before the start and after the end: offset.",
    fields: Chirp::FIELDS,
    example: "\
[signal.sweep]
kind = \"chirp\"
amplitude = \"1 N m\"
from = \"1 Hz\"
to = \"50 Hz\"
over = \"2 s\"
sweep = \"logarithmic\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [from, to, over] = ["from", "to", "over"].map(|key| values.exact_or_default(key));
    let (on, clock) = writer.clock(&values.exact_or_default("start"), Some(&over))?;
    let [first, last, length] = [&from, &to, &over].map(|value| writer.exact(value));
    let graph = &mut *writer.graph;
    let waves = if values.word_or_default("sweep") == "logarithmic" && from != to {
        let growth = graph.divide(last, first);
        let growth = graph.apply(Function::Ln, growth);
        let part = graph.product(&[(growth, 1), (clock, 1), (length, -1)]);
        let grown = graph.apply(Function::Exp, part);
        let grown = graph.sum(Rational::from(-1), &[(grown, Rational::ONE)]);
        graph.product(&[(first, 1), (length, 1), (grown, 1), (growth, -1)])
    } else {
        let more = graph.subtract(last, first);
        let bent = graph.product(&[(more, 1), (clock, 2), (length, -1)]);
        let straight = graph.multiply(first, clock);
        graph.sum(Rational::ZERO, &[(straight, Rational::ONE), (bent, Rational::from_parts(1.into(), 2u8.into()))])
    };
    let angle = writer.turns(waves, &values.exact_or_default("phase"));
    Ok(writer.wave(values, on, angle))
}
