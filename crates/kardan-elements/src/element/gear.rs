//! The element `gear`: two bodies in a fixed ratio.

use super::Element;
use super::shared::contact::{RESTITUTION, Side, backlash_of, backlash_terms, check_backlash};
use super::shared::gear_loss::{EFFICIENCY, EFFICIENCY_BACK, LOSS, check_gear_loss, gear_loss};
use super::shared::shafts::{ENDS, check_ends};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// Two shafts (or two masses) in a fixed ratio, \[diss. (4.3)\].
    element Gear("gear") {
        required {
            shaft_1: Body, "The first shaft, or mass of a lever.";
            shaft_2: Body, "The second shaft or mass.";
            ratio: Number(Sign::NonZero),
                "i: turns of the first shaft for one turn of the second; a fraction such as \"51/50\" stays exact.";
        }
        optional {
            offset: Mechanical(Dimension::ANGLE, Sign::Any) = "0 deg", "Mounting offset.";
            backlash: Mechanical(Dimension::ANGLE, Sign::NonNegative),
                "Backlash of the teeth, as an angle of shaft_1 (a displacement of the first mass): within half of it either way no torque is \
                 transmitted. Left out: none.";
            efficiency: Number(Sign::Positive) as EFFICIENCY;
            efficiency_back: Number(Sign::Any) as EFFICIENCY_BACK;
            loss: Formula(Dimension::TORQUE) as LOSS;
            restitution: Number(Sign::NonNegative) as RESTITUTION;
        }
    }
}

pub(super) const GEAR: Element = Element {
    keyword: Gear::KEYWORD,
    summary: "Two shafts, or two masses, in a fixed ratio: q1 - i q2 + offset = 0.",
    sketch: r"
    shaft_1 ====[ ]
                [ ]   q1 - i q2 + offset = 0
    shaft_2 ====[ ]",
    signs: "With a ratio above zero both shafts rotate in the same direction; an external spur pair has a negative ratio. `<name>.tau` acts on \
            shaft_1, and -i times it on shaft_2. The loss torque `<name>.friction` acts on shaft_1 against its rotation.",
    symbol: Symbol::Gear,
    fields: Gear::FIELDS,
    example: "\
[gear.reduction]
shaft_1 = \"motor\"
shaft_2 = \"load\"
ratio = \"51/5\"
",
    check: |values| [check_ends(values, ENDS), check_backlash(values), check_gear_loss(values)].concat(),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let ratio = values.ratio();
    let direction = Direction {
        entries: vec![
            (values.word_or_default("shaft_1").into(), Exact::one()),
            (values.word_or_default("shaft_2").into(), -&ratio),
        ],
    };
    let offset = -&values.exact_or_default("offset");
    let loss = gear_loss(Direction::shaft(values.word_or_default("shaft_1")), values);
    let teeth = match backlash_of(values) {
        Some(backlash) => backlash_terms(&direction, &offset, backlash, &Side::of(values)),
        None => vec![Term::Constraint { direction, offset }],
    };
    teeth.into_iter().chain(loss).collect()
}
