use super::shared::straight::{check_moves, straight};
use super::{Element, Mistake, Values};
use crate::equations::Term;
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, Sign, keys};
use crate::units::{Dimension, Exact};

keys! {
    /// A pinion that moves a rack.
    element RackAndPinion("rack_and_pinion") {
        required {
            pinion: Shaft, "The shaft of the pinion.";
            rack: Mass, "The rack.";
        }
        optional {
            radius: Quantity(Dimension::LENGTH, Sign::NonZero), "Pitch radius of the pinion; needed, or `travel`.";
            travel: Quantity(Dimension::LENGTH_PER_ANGLE, Sign::NonZero),
                "Travel of the rack for a turn of the pinion, in place of `radius`: \"44 mm/rev\".";
            offset: Quantity(Dimension::LENGTH, Sign::Any) = "0 mm", "Position of the rack where the pinion stands at zero.";
        }
    }
}

/// A pinion that moves a rack.
pub const RACK_AND_PINION: Element = Element {
    keyword: RackAndPinion::KEYWORD,
    summary: "A pinion that moves a rack: s - r phi = offset.",
    sketch: r"
            ( o )  pinion, phi >0
      ======/\/\/\======>  rack, s >0     s - r phi = offset",
    signs: "A positive radius means that the rack moves forward as the pinion turns forward. `<name>.f` is the force of the \
            teeth on the rack; on the pinion acts -r times it, `<name>.<pinion>.tau`.",
    symbol: Symbol::Gear,
    fields: RackAndPinion::FIELDS,
    example: "\
[rack_and_pinion.teeth]
pinion = \"pinion\"
rack = \"rack\"
radius = \"7 mm\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<Mistake> {
    let mut out = check_moves(values, &["pinion", "rack"]);
    match (values.has("radius"), values.has("travel")) {
        (true, true) => out.push(Mistake::new("travel", "both `radius` and `travel` are given", "keep one of them")),
        (false, false) => out.push(Mistake::new(
            "radius",
            "it needs the radius of the pinion, or the travel of the rack for a turn",
            "add `radius = \"7 mm\"` or `travel = \"44 mm/rev\"`",
        )),
        _ => {}
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let ends = ["pinion", "rack"].map(|key| values.word_or_default(key));
    let lead = values.exact("travel").or(values.exact("radius")).cloned().unwrap_or_else(Exact::one);
    straight(ends, &lead, values.exact_or_default("offset"))
}
