//! The element `one_way_clutch`: a freewheel.

use super::Element;
use super::shared::shafts::check_ends;
use kardan_mechanics::equations::{Direction, Term, UnilateralConstraint};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A freewheel: one shaft drives the other forward and lets it overrun.
    element OneWayClutch("one_way_clutch") {
        required {
            driven: Body, "The shaft or mass that may overrun, and never falls behind.";
        }
        optional {
            driving: Body, "The shaft or mass that drives it; left out: the housing, so that `driven` never rotates backwards.";
        }
    }
}

pub(super) const ONE_WAY_CLUTCH: Element = Element {
    keyword: OneWayClutch::KEYWORD,
    summary: "One-way clutch (freewheel, backstop): the driven shaft may overrun the driving one and is never slower.",
    sketch: r"
    driving ===|>|=== driven      w(driven) >= w(driving)",
    signs: "`<name>.tau` acts on `driving` forward and on `driven` backward; it is zero or negative, and zero while `driven` overruns.",
    symbol: Symbol::Clutch,
    fields: OneWayClutch::FIELDS,
    example: "\
[one_way_clutch.hub]
driving = \"sprocket\"
driven = \"wheel\"
",
    check: |values| check_ends(values, ["driving", "driven"]),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::difference(values.word_or_default("driven"), values.word("driving"));
    vec![Term::UnilateralConstraint { direction, unilateral: UnilateralConstraint::OneWay }]
}
