use super::{BREAKAWAY, Element, Mistake, STRIBECK_SPEED, Values, check_losses, gear, losses};
use crate::equations::{Direction, Term};
use crate::schema::{Field, Kind, Sign};
use crate::units::Dimension;

/// Spring, damper and friction in parallel between two shafts or to the housing.
pub const SPRING_DAMPER: Element = Element {
    keyword: "spring_damper",
    summary: "Spring, viscous damper and Coulomb friction in parallel between two shafts, or from a shaft to the housing.",
    sketch: r"
                 s
    shaft_1 ===/\/\/\=== shaft_2
            ===[ d ]====
            ===[ c ]====",
    signs: "The twist is q1 - q2 - rest; `<name>.tau` = s twist + d (w1 - w2) is the torque that tries to turn \
            shaft_2 forward and shaft_1 back.",
    fields: &[
        Field::required("shaft_1", Kind::Shaft, "The first shaft."),
        Field::optional("shaft_2", Kind::Shaft, "The second shaft; left out: the housing."),
        Field::optional(
            "stiffness",
            Kind::Quantity(Dimension::STIFFNESS, Sign::NonNegative),
            "Torsional stiffness; left out: no spring.",
        ),
        Field::optional("damping", Kind::Quantity(Dimension::DAMPING, Sign::Any), "Viscous damping; left out: none."),
        Field::optional(
            "friction",
            Kind::Quantity(Dimension::TORQUE, Sign::NonNegative),
            "Coulomb friction torque; left out: none.",
        ),
        BREAKAWAY,
        STRIBECK_SPEED,
        Field::optional(
            "rest",
            Kind::Quantity(Dimension::ANGLE, Sign::Any),
            "The angle q1 - q2 at which the spring is relaxed; left out: zero.",
        ),
    ],
    example: "\
[spring_damper.torsion_bar]
shaft_1 = \"rk\"
shaft_2 = \"cj\"
stiffness = \"100 N m/rad\"
damping = \"0.02 N m s/rad\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<Mistake> {
    [gear::check(values), check_losses(values)].concat()
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let along = Direction::difference(values.required("shaft_1"), values.word("shaft_2"));
    let mut out = Vec::new();
    if let Some(stiffness) = values.exact("stiffness").filter(|x| !x.is_zero()) {
        out.push(Term::Spring {
            along: along.clone(),
            stiffness: stiffness.clone(),
            rest: values.exact_or_zero("rest"),
        });
    }
    out.extend(losses(&along, values));
    out
}
