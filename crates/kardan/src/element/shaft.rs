use super::{BREAKAWAY, Element, STRIBECK_SPEED, Values, check_losses, losses};
use crate::equations::{Direction, Term};
use crate::schema::{Field, Kind, Sign};
use crate::units::Dimension;

/// A rigid rotating body; every other element names the shafts it acts on.
pub const SHAFT: Element = Element {
    keyword: "shaft",
    summary: "A rigid rotating body with inertia, viscous damping and Coulomb friction against the housing.",
    sketch: r"
        phi, tau >0
           --->
    ==========[ J ]==========
             d | c
            -------  housing",
    signs: "Angle, speed and torque of a shaft count positive in one common sense, chosen once for the whole model.",
    fields: &[
        Field::optional(
            "inertia",
            Kind::Quantity(Dimension::INERTIA, Sign::NonNegative),
            "Moment of inertia; left out: massless.",
        ),
        Field::optional(
            "damping",
            Kind::Quantity(Dimension::DAMPING, Sign::Any),
            "Viscous damping against the housing; left out: none. An equivalent damping identified on a gear may be \
             negative as long as the whole model stays passive.",
        ),
        Field::optional(
            "friction",
            Kind::Quantity(Dimension::TORQUE, Sign::NonNegative),
            "Coulomb friction torque against the housing, the same at rest and in motion without `breakaway`; left out: none.",
        ),
        BREAKAWAY,
        STRIBECK_SPEED,
    ],
    example: "\
[shaft.fs]
inertia = \"50000 kg mm^2\"
damping = \"0.1 N m s/rad\"
friction = \"0.2 N m\"
",
    check: check_losses,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let along = Direction::shaft(name);
    let mut out = Vec::new();
    if let Some(inertia) = values.exact("inertia").filter(|x| !x.is_zero()) {
        out.push(Term::Inertia { along: along.clone(), inertia: inertia.clone() });
    }
    out.extend(losses(&along, values));
    out
}
