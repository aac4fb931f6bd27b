//! The element `mass`: a rigid body in translation.

use super::Element;
use super::shared::losses::{check_losses, inertia, losses};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A rigid body in translation.
    element Mass("mass") {
        optional {
            mass: Quantity(Dimension::MASS, Sign::NonNegative) = "0 kg", "Mass.";
            damping: Quantity(Dimension::LINEAR_DAMPING, Sign::Any) = "0 N s/m", "Viscous damping against the ground.";
            friction: Quantity(Dimension::FORCE, Sign::NonNegative) = "0 N",
                "Coulomb friction force against the ground, the same at rest and in motion without `breakaway`.";
            breakaway: Quantity(Dimension::FORCE, Sign::NonNegative),
                "Breakaway force at rest, not below `friction`; in motion the friction falls from it as friction + (breakaway - friction) \
                 exp(-(v/stribeck_speed)^2). Only simulations use it; designs neglect friction. Left out: equal to `friction`.";
            stribeck_speed: Quantity(Dimension::VELOCITY, Sign::Positive),
                "Velocity with which the friction falls from `breakaway`; needed with it.";
        }
    }
}

pub(super) const MASS: Element = Element {
    keyword: Mass::KEYWORD,
    summary: "A rigid body that moves straight, with mass, viscous damping and Coulomb friction against the ground.",
    sketch: r"
        s, f >0
         --->
       [  m  ]
       --d-c--  ground",
    signs: "Position `<name>.s`, velocity `<name>.v` and forces of a mass count positive in one sense, chosen once. Gears, springs, \
            motors and sensors name masses as they name shafts, by `mass`, `mass_1`, `mass_2`.",
    symbol: Symbol::Mass,
    fields: Mass::FIELDS,
    example: "\
[mass.rack]
mass = \"2.5 kg\"
damping = \"50 N s/m\"
friction = \"120 N\"
",
    check: |values| check_losses(values, true),
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::shaft(name);
    let mut out = vec![Term::Coordinate { name: name.to_string(), domain: Domain::Translation }];
    out.extend(inertia(&direction, values.exact("mass")));
    out.extend(losses(&direction, values));
    out
}
