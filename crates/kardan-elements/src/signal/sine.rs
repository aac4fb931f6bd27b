//! The signal `sine`.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::Expr;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// A sine.
    signal Sine("sine") {
        required {
            amplitude: AnyQuantity, "Largest deviation from the offset; its unit is that of the signal.";
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive), "Frequency, `2 Hz`; or period, `0.5 s`.";
        }
        optional {
            phase: Quantity(Dimension::ANGLE, Sign::Any) = "0 rad", "Phase at the start.";
            offset: AnyQuantity, "Added offset, which is the value before the start; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const SINE: SignalKind = SignalKind {
    keyword: Sine::KEYWORD,
    summary: "A sine.",
    formula: "offset + amplitude sin(2 pi frequency (t - start) + phase); before the start: offset.",
    fields: Sine::FIELDS,
    example: "\
[signal.wobble]
kind = \"sine\"
amplitude = \"2 N m\"
frequency = \"3 Hz\"
phase = \"90 deg\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let (on, clock) = writer.clock(&values.exact_or_default("start"), None)?;
    let frequency = writer.exact(&values.exact_or_default("frequency"));
    let waves = writer.graph.multiply(frequency, clock);
    let angle = writer.turns(waves, &values.exact_or_default("phase"));
    Ok(writer.wave(values, on, angle))
}
