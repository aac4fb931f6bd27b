//! The element `current_source` of a circuit.

use std::sync::Arc;

use super::Element;
use super::shared::branch::{FROM, branch, check_branch};
use kardan_expr::expr::OfTime;
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, MultiplierLaw, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// An ideal current source: a branch whose current is a function of time.
    element CurrentSource("current_source") {
        required {
            from: Node as FROM;
            to: Node, "The node that a positive current enters.";
        }
        optional {
            current: OfTime(Dimension::CURRENT),
                "The current: a value, or a smooth function of the time `t`, parameters, signals `[signal.NAME]` and tables, which must not \
                 jump. Left out: zero until events of the scenario set `<name>.i`, in ramps.";
        }
    }
}

pub(super) const CURRENT_SOURCE: Element = Element {
    keyword: CurrentSource::KEYWORD,
    summary: "An ideal current source between two nodes of a circuit: its current follows a function of time, at any voltage.",
    sketch: r"
                i(t)
    from ----- ( -> ) --->--- to
                         i >0",
    signs: "`<name>.i` flows through the source from `from` to `to`; `<name>.v` is the potential of `to` less that of `from`, so that v i is the \
            power that the source delivers.",
    symbol: Symbol::CurrentSource,
    fields: CurrentSource::FIELDS,
    example: "\
[current_source.feed]
from = \"ground\"
to = \"in\"
current = \"2 A * sin(2 pi t / 20 ms)\"
",
    check: check_branch,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    let function = match values.of_time("current") {
        Some(function) => Arc::clone(function),
        None => Arc::new(OfTime::constant(&values.exact_or_default("current"), Dimension::CURRENT)),
    };
    // If the charge is known at every time, it is eliminated; else a multiplier enforces the current.
    match function.integral() {
        Some(charge) => {
            out.push(Term::Constraint { direction: Direction::shaft(name), offset: Exact::zero() });
            out.push(Term::Moving(Arc::new(charge)));
        }
        None => {
            let row = vec![(name.to_string(), Exact::one())];
            out.push(Term::MultiplierLaw(MultiplierLaw::Prescribed { row, order: 1, function }));
        }
    }
    out
}
