//! The signal `ramp`: from one value to another at a constant rate.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::Expr;
use kardan_math::num::rational_to_f64;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// A ramp from one value to another.
    signal Ramp("ramp") {
        required {
            to: AnyQuantity, "Value at the end; its unit is that of the signal.";
            over: Quantity(Dimension::TIME, Sign::Positive), "How long it takes.";
        }
        optional {
            from: AnyQuantity, "Value before the start; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const RAMP: SignalKind = SignalKind {
    keyword: Ramp::KEYWORD,
    summary: "A straight line from one value to another, constant before and after it.",
    formula: "from + (to - from) x/over with x = t - start, not below 0 and not above over.",
    fields: Ramp::FIELDS,
    example: "\
[signal.rise]
kind = \"ramp\"
to = \"30 deg\"
start = \"0.1 s\"
over = \"0.5 s\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [from, to, over] = ["from", "to", "over"].map(|key| values.number_or_default(key));
    let [start, length] = ["start", "over"].map(|key| values.exact_or_default(key).to_rational());
    let (begin, end) = (rational_to_f64(&start), rational_to_f64(&(start + length)));
    let level = |level: f64| [level, 0.0, 0.0, 0.0];
    let pieces = [(0.0, level(from)), (begin, [from, (to - from) / over, 0.0, 0.0]), (end, level(to))];
    writer.pieces("", (writer.dimension, false), pieces.into_iter())
}
