//! The signal `sine_with_dwell`: one period of a sine that pauses at its second peak.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::Expr;
use kardan_math::num::rational_to_f64;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// One period of a sine that stays at its second peak.
    signal SineWithDwell("sine_with_dwell") {
        required {
            amplitude: AnyQuantity, "Largest deviation from the offset; its unit is that of the signal.";
        }
        optional {
            frequency: Quantity(Dimension::FREQUENCY, Sign::Positive) = "0.7 Hz", "Frequency of the sine.";
            dwell: Quantity(Dimension::TIME, Sign::NonNegative) = "0.5 s", "How long it stays at its second peak.";
            offset: AnyQuantity, "Added offset, which is the value before the start and after the end; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const SINE_WITH_DWELL: SignalKind = SignalKind {
    keyword: SineWithDwell::KEYWORD,
    summary: "One period of a sine that stays at its second peak: the steering input of FMVSS 126 and UN R140.",
    formula: "offset + amplitude sin(2 pi frequency x) with x = t - start up to 3/4 of the period, then constant for the dwell, then on to the end \
              of the\n\
              period; before the start and after the end (start + 1/frequency + dwell): offset.",
    fields: SineWithDwell::FIELDS,
    example: "\
[signal.hands]
kind = \"sine_with_dwell\"
amplitude = \"100 deg\"
start = \"0.5 s\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [start, dwell] = ["start", "dwell"].map(|key| values.exact_or_default(key).to_rational());
    let frequency = values.exact_or_default("frequency");
    let period = frequency.recip().map(|period| period.to_rational()).unwrap_or_default();
    let waits = &start + &period * kardan_math::num::Rational::from_parts(3.into(), 4u8.into());
    let goes_on = &waits + &dwell;
    let end = &start + &period + &dwell;
    let [begin, waits, goes_on, end] = [&start, &waits, &goes_on, &end].map(rational_to_f64);
    let (three_quarters, period) = (0.75 * rational_to_f64(&period), rational_to_f64(&period));
    let level = |level: f64| [level, 0.0, 0.0, 0.0];
    let before = |value: f64| (begin > 0.0).then_some((0.0, level(value)));
    let on = before(0.0).into_iter().chain([(begin, level(1.0)), (end, level(0.0))]);
    let rises = |from: f64| [from, 1.0, 0.0, 0.0];
    let dwell = (goes_on > waits).then_some((waits, level(three_quarters)));
    let clock = [(begin, rises(0.0))].into_iter().chain(dwell);
    let clock = clock.chain([(goes_on, rises(three_quarters)), (end, level(period))]);
    let clock = before(0.0).into_iter().chain(clock);
    let on = writer.pieces("on", (Dimension::NONE, false), on)?;
    let clock = writer.pieces("clock", (Dimension::TIME, false), clock)?;
    let frequency = writer.exact(&frequency);
    let waves = writer.graph.multiply(frequency, clock);
    let angle = writer.turns(waves, &kardan_math::units::Exact::zero());
    Ok(writer.wave(values, on, angle))
}
