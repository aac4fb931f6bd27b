//! The element `end_stop`: stops that limit an angle or a distance.

use super::shared::contact::{Side, check_contact, contact};
use super::shared::shafts::{ENDS, check_ends};
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// Stops that limit an angle or a distance.
    element EndStop("end_stop") {
        required {
            shaft_1: Body, "The first shaft or mass.";
        }
        optional {
            shaft_2: Body, "The second; left out: the housing.";
            lower: Mechanical(Dimension::ANGLE, Sign::Any), "The least q1 - q2; left out: no stop on this side.";
            upper: Mechanical(Dimension::ANGLE, Sign::Any), "The largest q1 - q2; left out: no stop on this side.";
            restitution: Number(Sign::NonNegative) = "0",
                "Of a rigid stop: coefficient of restitution, the part of the speed with which it rebounds, 0 to 1.";
            stiffness: Mechanical(Dimension::STIFFNESS, Sign::Positive), "Of a soft stop; left out: the stop is rigid.";
            damping: Mechanical(Dimension::DAMPING, Sign::NonNegative) = "0 N m s/rad",
                "Of a soft stop: its contact force is s d + d d', and never pulls.";
        }
    }
}

pub(super) const END_STOP: Element = Element {
    keyword: EndStop::KEYWORD,
    summary: "Stops that limit an angle or a distance: rigid, with restitution, or soft; a ball on the ground, a rack at its end.",
    sketch: r"
        |              |
    lower|<-- q1 - q2 -->|upper
        |              |",
    signs: "`<name>.tau` (between masses `<name>.f`) acts on shaft_2 forward and on shaft_1 backward: above zero at the upper stop, below at the \
            lower one. A rigid stop returns `restitution` times the impact speed; the run reports the energy that the impact dissipates.",
    symbol: Symbol::Stop,
    fields: EndStop::FIELDS,
    example: "\
[end_stop.rack]
shaft_1 = \"pinion\"
lower = \"-540 deg\"
upper = \"540 deg\"
stiffness = \"2 kN m/rad\"
damping = \"10 N m s/rad\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = [check_ends(values, ENDS), check_contact(values, "lower")].concat();
    match (values.exact("lower"), values.exact("upper")) {
        (None, None) if !values.has("lower") && !values.has("upper") => {
            out.push(KeyError::new("shaft_1", "it has no stop on either side", "give `lower`, `upper` or both"))
        }
        (Some(lower), Some(upper)) if lower.to_f64() >= upper.to_f64() => out.push(KeyError::new(
            "upper",
            "the upper stop is not above the lower one, so the range between them is empty",
            "make `upper` larger than `lower`; to fix a shaft use a `constraint`",
        )),
        _ => {}
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::difference(values.word_or_default("shaft_1"), values.word("shaft_2"));
    contact(&direction, [values.exact("lower").cloned(), values.exact("upper").cloned()], &Side::of(values))
}
