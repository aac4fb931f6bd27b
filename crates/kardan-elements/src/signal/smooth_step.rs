//! The signal `smooth_step`: a step with a continuous rate.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::Expr;
use kardan_math::num::rational_to_f64;
use kardan_math::units::Dimension;
use kardan_schema::schema::{Keys, Sign, SignalKeys, Values, keys};

keys! {
    /// A step with a continuous rate.
    signal SmoothStep("smooth_step") {
        required {
            to: AnyQuantity, "Value at the end; its unit is that of the signal.";
            over: Quantity(Dimension::TIME, Sign::Positive), "How long it takes: its rate is at most 1.5 (to - from)/over, in the middle.";
        }
        optional {
            from: AnyQuantity, "Value before the start; left out: zero.";
            start: Quantity(Dimension::TIME, Sign::NonNegative) = "0 s", "When it begins.";
        }
    }
}

pub(super) const SMOOTH_STEP: SignalKind = SignalKind {
    keyword: SmoothStep::KEYWORD,
    summary: "A step from one value to another with a continuous rate, constant before and after it.",
    formula: "from + (to - from) (3 x^2 - 2 x^3) with x = (t - start)/over, not below 0 and not above 1.",
    fields: SmoothStep::FIELDS,
    example: "\
[signal.turn_in]
kind = \"smooth_step\"
to = \"60 deg\"
start = \"1 s\"
over = \"0.3 s\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let [from, to, over] = ["from", "to", "over"].map(|key| values.number_or_default(key));
    let [start, length] = ["start", "over"].map(|key| values.exact_or_default(key).to_rational());
    let (begin, end) = (rational_to_f64(&start), rational_to_f64(&(start + length)));
    let level = |level: f64| [level, 0.0, 0.0, 0.0];
    let way = (to - from) / (over * over);
    let before = (begin > 0.0).then_some((0.0, level(from)));
    let pieces = before.into_iter().chain([(begin, [from, 0.0, 3.0 * way, -2.0 * way / over]), (end, level(to))]);
    writer.pieces("", (writer.dimension, false), pieces)
}
