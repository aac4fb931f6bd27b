//! The signal `expression`: an explicit function of time.

use super::{Refused, SignalKind, SignalWriter};
use kardan_expr::expr::Expr;
use kardan_math::units::Expression;
use kardan_schema::schema::{Keys, SignalKeys, Values, keys};

keys! {
    /// An explicit function of time.
    signal ExpressionSignal("expression") {
        required {
            value: Text, "An expression of the time `t`, parameters and other signals: `\"2 N m * sin(2 pi t / 1 s) * gate\"`.";
        }
    }
}

pub(super) const EXPRESSION: SignalKind = SignalKind {
    keyword: ExpressionSignal::KEYWORD,
    summary: "An expression of the time, parameters and other signals.",
    formula: "The value of the expression; `t` is the time, functions are those of `kardan elements parameters`. At kinks and jumps of `abs`, \
              `min`,\n\
              `max` or `if` no step of the integrator ends; pulses, ramps and tables have exact breakpoints.",
    fields: ExpressionSignal::FIELDS,
    example: "\
[signal.fading]
kind = \"expression\"
value = \"2 N m * exp(-t / 0.5 s) * sin(2 pi t / 0.1 s)\"
",
    check: |_| Vec::new(),
    write,
};

fn write(values: &Values, writer: &mut SignalWriter<'_>) -> Result<Expr, Refused> {
    let read = Expression::parse_law(values.word_or_default("value")).map_err(Refused::Expression)?;
    let bindings = writer.names;
    let mut names = |_: &mut _, name: &str| {
        let found = bindings.iter().find(|(candidate, _)| candidate == name);
        found.map(|(_, named)| named.clone())
    };
    let (value, dimension) = writer.graph.lowered(&read, &mut names).map_err(Refused::Expression)?;
    writer.dimension = dimension;
    Ok(value)
}
