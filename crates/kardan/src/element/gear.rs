use super::shared::contact::{check_contact, contact, opposite};
use super::shared::mesh::{EFFICIENCY, EFFICIENCY_BACK, LOSS, check_mesh, mesh};
use super::{Element, Mistake, Values};
use crate::equations::{Direction, Term};
use crate::num::Rational;
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, Sign, keys};
use crate::units::{Dimension, Exact};

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
                "Play between the teeth, as an angle of shaft_1 (a way of the first mass): within half of it either way nothing is carried. Left out: none.";
            efficiency: Number(Sign::Positive) as EFFICIENCY;
            efficiency_back: Number(Sign::Any) as EFFICIENCY_BACK;
            loss: Formula(Dimension::TORQUE) as LOSS;
            restitution: Number(Sign::NonNegative) = "0", "With backlash: the part of the speed that teeth go back with, 0 to 1.";
        }
    }
}

/// Two shafts (or two masses) in a fixed ratio, \[diss. (4.3)\].
pub const GEAR: Element = Element {
    keyword: Gear::KEYWORD,
    summary: "Two shafts, or two masses, in a fixed ratio: q1 - i q2 + offset = 0.",
    sketch: r"
    shaft_1 ====[ ]
                [ ]   q1 - i q2 + offset = 0
    shaft_2 ====[ ]",
    signs: "A ratio above zero means that both shafts turn the same way; an external spur pair has a negative ratio. \
            `<name>.tau` acts on shaft_1, and -i times it on shaft_2. What is lost acts on shaft_1 against its turning, \
            `<name>.friction`.",
    symbol: Symbol::Gear,
    fields: Gear::FIELDS,
    example: "\
[gear.reduction]
shaft_1 = \"motor\"
shaft_2 = \"load\"
ratio = \"51/5\"
",
    check: check_gear,
    terms,
};

fn check_gear(values: &Values) -> Vec<Mistake> {
    let mut out = [check(values), check_contact(values, "backlash"), check_mesh(values)].concat();
    let plays = values.exact("backlash").is_some_and(|backlash| !backlash.is_zero());
    if !plays && values.exact("restitution").is_some_and(|e| !e.is_zero()) {
        out.push(Mistake::new("restitution", "without `backlash` teeth never part", "add `backlash`, or remove it"));
    }
    for key in ["efficiency", "loss"].into_iter().filter(|key| plays && values.has(key)) {
        let message = "teeth with `backlash` carry their torque without loss here";
        out.push(Mistake::new(
            key,
            message,
            "take one of the two away, or give the play to a gear of ratio 1 behind this one",
        ));
    }
    out
}

/// Both ends are not the same body.
pub(super) fn check(values: &Values) -> Vec<Mistake> {
    if values.word("shaft_1").is_some() && values.word("shaft_1") == values.word("shaft_2") {
        return vec![Mistake::new(
            "shaft_2",
            format!("both ends are `{}`", values.word_or_default("shaft_1")),
            "name two different ones",
        )];
    }
    Vec::new()
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let ratio = values.ratio();
    let along = Direction {
        entries: vec![
            (values.word_or_default("shaft_1").into(), Exact::one()),
            (values.word_or_default("shaft_2").into(), -&ratio),
        ],
    };
    let offset = values.exact_or_default("offset");
    match values.exact("backlash").filter(|backlash| !backlash.is_zero()) {
        Some(backlash) => {
            // The torque on shaft_1 is that which opposes motion the other way.
            let half = backlash * &Exact::new(Rational::from_parts(1.into(), 2u8.into()), 0);
            contact(&opposite(&along), [offset.plus(&-&half), offset.plus(&half)].map(Some), values)
        }
        None => {
            let loss = mesh(Direction::shaft(values.word_or_default("shaft_1")), values);
            [Term::Constraint { along, offset: -&offset }].into_iter().chain(loss).collect()
        }
    }
}
