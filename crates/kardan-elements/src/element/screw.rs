//! The element `screw`: a screw that moves a nut.

use super::Element;
use super::shared::contact::{RESTITUTION, check_backlash};
use super::shared::gear_loss::{EFFICIENCY, EFFICIENCY_BACK, LOSS, check_gear_loss, gear_loss};
use super::shared::straight::{check_moves, straight};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A screw that moves a nut.
    element Screw("screw") {
        required {
            shaft: Shaft, "The shaft of the screw.";
            nut: Mass, "The mass or shaft that moves with the nut.";
            lead: Quantity(Dimension::LENGTH_PER_ANGLE, Sign::NonZero), "Travel for a turn: \"5 mm/rev\".";
        }
        optional {
            offset: Quantity(Dimension::LENGTH, Sign::Any) = "0 mm", "Position of the nut at screw angle zero.";
            backlash: Quantity(Dimension::LENGTH, Sign::NonNegative),
                "Backlash of the nut, a distance: within half of it either way no force is transmitted. Left out: none.";
            restitution: Number(Sign::NonNegative) as RESTITUTION;
            efficiency: Number(Sign::Positive) as EFFICIENCY;
            efficiency_back: Number(Sign::Any) as EFFICIENCY_BACK;
            loss: Formula(Dimension::TORQUE) as LOSS;
        }
    }
}

pub(super) const SCREW: Element = Element {
    keyword: Screw::KEYWORD,
    summary: "A screw that moves a nut, such as a ball screw: s - lead phi = offset.",
    sketch: r"
    shaft ====/////[nut]/////====     s - lead phi = offset
        phi >0      ---> s >0",
    signs: "A positive lead means that the nut moves forward as the screw turns forward. `<name>.f` is the force of the thread on the nut; on the \
            screw acts -lead times it, `<name>.<shaft>.tau`. The loss torque `<name>.friction` acts on the screw against its rotation.",
    symbol: Symbol::Gear,
    fields: Screw::FIELDS,
    example: "\
[screw.ball_screw]
shaft = \"motor\"
nut = \"table\"
lead = \"5 mm/rev\"
",
    check: |values| [check_moves(values, &["shaft", "nut"]), check_backlash(values), check_gear_loss(values)].concat(),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let lead = values.exact("lead").cloned().unwrap_or_else(Exact::one);
    let ends = ["shaft", "nut"].map(|key| values.word_or_default(key));
    let loss = gear_loss(Direction::shaft(ends[0]), values);
    straight(ends, &lead, values).into_iter().chain(loss).collect()
}
