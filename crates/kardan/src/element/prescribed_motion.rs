use super::shared::prescribed::right_side;
use super::shared::straight::check_moves;
use super::{Element, Values};
use crate::equations::{Direction, Domain, Term};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, keys};
use crate::units::Dimension;

keys! {
    /// A shaft or a mass that follows a function of time.
    element PrescribedMotion("prescribed_motion") {
        required {
            shaft: Body, "The shaft or mass that moves as prescribed.";
            angle: OfTime(Dimension::ANGLE),
                "Its angle, of a mass its position: a smooth function of the time `t`, parameters, signals `[signal.NAME]` and tables. The \
                 function and its rate must not jump.";
        }
        optional {
            reference: Body, "The shaft or mass that the angle is measured from; left out: the housing.";
        }
    }
}

/// A shaft or a mass that follows a function of time.
pub const PRESCRIBED_MOTION: Element = Element {
    keyword: PrescribedMotion::KEYWORD,
    summary: "A shaft or a mass that moves as a function of time says, whatever torque or force that takes.",
    sketch: r"
    angle(t)  -->  shaft  (against reference)",
    signs: "`<name>.tau` (of a mass the force `<name>.f`) is the torque that the motion takes: positive turns the shaft forward; the opposite \
            acts on `reference`. Times the rate of the angle it is the power that the motion gives to the model.",
    symbol: Symbol::Torque,
    fields: PrescribedMotion::FIELDS,
    example: "\
[prescribed_motion.drive]
shaft = \"motor\"
angle = \"30 deg * sin(2 pi t / 1 s)\"
",
    check: |values| check_moves(values, &["shaft"]),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let along = Direction::difference(values.word_or_default("shaft"), values.word("reference"));
    let measure = values.along_masses.then_some(Term::Measure(Domain::Translation));
    let (offset, moving) = right_side(values, "angle");
    measure.into_iter().chain([Term::Constraint { along, offset }]).chain(moving).collect()
}
