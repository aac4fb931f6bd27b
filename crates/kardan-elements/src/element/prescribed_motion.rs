//! The element `prescribed_motion`: a body that follows a function of time.

use std::sync::Arc;

use super::shared::prescribed::right_side;
use super::shared::straight::check_moves;
use super::{Element, KeyError};
use kardan_expr::expr::OfTime;
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Domain, MultiplierLaw, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// A shaft or a mass that follows a function of time.
    element PrescribedMotion("prescribed_motion") {
        required {
            shaft: Body, "The shaft or mass that moves as prescribed.";
        }
        optional {
            angle: OfTime(Dimension::ANGLE),
                "The angle of a shaft: a smooth function of the time `t`, parameters, signals `[signal.NAME]` and tables. The function and \
                 its rate must not jump.";
            position: OfTime(Dimension::LENGTH), "The position of a mass, as `angle` for a shaft.";
            speed: OfTime(Dimension::ANGULAR_VELOCITY),
                "In place of `angle` or `position`: its speed, which must not jump; angle or position begin at `initial`.";
            acceleration: OfTime(Dimension::ANGULAR_ACCELERATION),
                "In place of `angle` or `position`: its acceleration, which may jump; angle or position and speed begin at `initial`.";
            reference: Body, "The shaft or mass that it is measured from; left out: the housing.";
        }
    }
}

pub(super) const PRESCRIBED_MOTION: Element = Element {
    keyword: PrescribedMotion::KEYWORD,
    summary: "A shaft or a mass that moves as a function of time prescribes, at any torque or force.",
    sketch: r"
    angle(t)  -->  shaft  (against reference)",
    signs: "`<name>.tau` (of a mass the force `<name>.f`) is the torque that the motion requires: positive drives the shaft forward; the opposite \
            acts on `reference`. Times the rate of the angle it is the power that the motion supplies to the model.",
    symbol: Symbol::Torque,
    fields: PrescribedMotion::FIELDS,
    example: "\
[prescribed_motion.drive]
shaft = \"motor\"
angle = \"30 deg * sin(2 pi t / 1 s)\"
",
    check,
    terms,
};

const MOTIONS: [&str; 4] = ["angle", "position", "speed", "acceleration"];

/// The key of its position, and that of the other kind of body.
fn places(values: &Values) -> [&'static str; 2] {
    if values.translational { ["position", "angle"] } else { ["angle", "position"] }
}

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = check_moves(values, &["shaft"]);
    let [own, wrong_key] = places(values);
    if values.has(wrong_key) {
        let body = if values.translational { "mass" } else { "shaft" };
        let article = if own == "angle" { "an" } else { "a" };
        let message = format!("a {body} has {article} {own}, no {wrong_key}");
        out.push(KeyError::new(wrong_key, message, format!("write `{own} = \"...\"`")));
    }
    let present: Vec<&'static str> = MOTIONS.into_iter().filter(|key| values.has(key)).collect();
    match present[..] {
        [] => {
            let help = format!("add `{own}`, `speed` or `acceleration`");
            out.push(KeyError::new("shaft", "no key defines its motion", help));
        }
        [_] => {}
        [first, second, ..] => {
            let message = format!("`{first}` and `{second}` both define its motion");
            out.push(KeyError::new(second, message, "remove one of the two"));
        }
    }
    if values.word("shaft") == values.word("reference") {
        let message = format!("`{}` does not move against itself", values.word_or_default("shaft"));
        out.push(KeyError::new("reference", message, "name another shaft, or remove `reference` for the housing"));
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::difference(values.word_or_default("shaft"), values.word("reference"));
    let measure = values.translational.then_some(Term::Measure(Domain::Translation));
    if let Some((order, key)) = [(1, "speed"), (2, "acceleration")].into_iter().find(|(_, key)| values.has(key)) {
        let function = match values.of_time(key) {
            Some(function) => Arc::clone(function),
            None => Arc::new(OfTime::constant(&values.exact_or_default(key), Dimension::NONE)),
        };
        let law = MultiplierLaw::Prescribed { row: direction.entries, order, function };
        return measure.into_iter().chain([Term::MultiplierLaw(law)]).collect();
    }
    let (offset, moving) = right_side(values, places(values)[0]);
    measure.into_iter().chain([Term::Constraint { direction, offset }]).chain(moving).collect()
}
