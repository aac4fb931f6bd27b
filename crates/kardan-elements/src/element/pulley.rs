//! The element `pulley`: a rope or belt on a pulley.

use super::Element;
use super::shared::contact::{RESTITUTION, check_backlash};
use super::shared::straight::{check_moves, straight};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::Term;
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A rope or belt on a pulley.
    element Pulley("pulley") {
        required {
            shaft: Shaft, "The shaft of the pulley.";
            mass: Mass, "The mass on the rope, or moved by the belt.";
            radius: Quantity(Dimension::LENGTH, Sign::NonZero), "Radius of the pulley to the middle of the rope.";
        }
        optional {
            offset: Quantity(Dimension::LENGTH, Sign::Any) = "0 mm", "Position of the mass at pulley angle zero.";
            backlash: Quantity(Dimension::LENGTH, Sign::NonNegative),
                "Backlash of a toothed belt, a displacement of the mass: within half of it either way no force is transmitted. Left out: none.";
            restitution: Number(Sign::NonNegative) as RESTITUTION;
        }
    }
}

pub(super) const PULLEY: Element = Element {
    keyword: Pulley::KEYWORD,
    summary: "A rope or belt that a pulley winds without slip or stretch, always tight: s - r phi = offset.",
    sketch: r"
        ( o )  shaft, phi >0
          |
        [ m ]  s >0            s - r phi = offset",
    signs: "With a negative radius the mass hangs on the other side. `<name>.f` is the force of the rope on the mass; on the shaft acts -r times \
            it, `<name>.<shaft>.tau`. The rope transmits compression as well as tension.",
    symbol: Symbol::Gear,
    fields: Pulley::FIELDS,
    example: "\
[pulley.hoist]
shaft = \"drum\"
mass = \"cabin\"
radius = \"0.2 m\"
",
    check: |values| [check_moves(values, &["shaft", "mass"]), check_backlash(values)].concat(),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let radius = values.exact("radius").cloned().unwrap_or_else(Exact::one);
    let ends = ["shaft", "mass"].map(|key| values.word_or_default(key));
    straight(ends, &radius, values)
}
