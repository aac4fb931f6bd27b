//! The element `shaft`: a rigid rotating body.

use super::Element;
use super::shared::losses::{BREAKAWAY, STRIBECK_SPEED, check_losses, inertia, losses};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A rigid rotating body; every other element names the shafts it acts on.
    element Shaft("shaft") {
        optional {
            inertia: Quantity(Dimension::INERTIA, Sign::NonNegative) = "0 kg m^2", "Moment of inertia.";
            damping: Quantity(Dimension::DAMPING, Sign::Any) = "0 N m s/rad",
                "Viscous damping against the housing. An equivalent damping identified on a gear may be negative as \
                 long as the whole model stays passive.";
            friction: Quantity(Dimension::TORQUE, Sign::NonNegative) = "0 N m",
                "Coulomb friction torque against the housing, the same at rest and in motion without `breakaway`.";
            breakaway: Mechanical(Dimension::TORQUE, Sign::NonNegative) as BREAKAWAY;
            stribeck_speed: Mechanical(Dimension::ANGULAR_VELOCITY, Sign::Positive) as STRIBECK_SPEED;
        }
    }
}

pub(super) const SHAFT: Element = Element {
    keyword: Shaft::KEYWORD,
    summary: "A rigid rotating body with inertia, viscous damping and Coulomb friction against the housing.",
    sketch: r"
        phi, tau >0
           --->
    ==========[ J ]==========
             d | c
            -------  housing",
    signs: "Angle, speed and torque of a shaft count positive in one common sense for the whole model. To fix a shaft, add `[constraint.NAME]` with \
            `coefficients = { SHAFT = 1 }`.",
    symbol: Symbol::Shaft,
    fields: Shaft::FIELDS,
    example: "\
[shaft.fs]
inertia = \"50000 kg mm^2\"
damping = \"0.1 N m s/rad\"
friction = \"0.2 N m\"
",
    check: |values| check_losses(values, false),
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::shaft(name);
    inertia(&direction, values.exact("inertia")).into_iter().chain(losses(&direction, values)).collect()
}
