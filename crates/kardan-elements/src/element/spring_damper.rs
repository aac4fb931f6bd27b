//! The element `spring_damper`: spring, damper and friction in parallel.

use super::shared::contact::{Side, backlash_of, centred_limits, contact};
use super::shared::losses::{BREAKAWAY, STRIBECK_SPEED, check_losses, losses};
use super::shared::shafts::{ENDS, check_ends};
use super::{Element, KeyError};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// Spring, damper and friction in parallel between two shafts or masses, or to the housing.
    element SpringDamper("spring_damper") {
        required {
            shaft_1: Body, "The first shaft or mass.";
        }
        optional {
            shaft_2: Body, "The second; left out: the housing.";
            stiffness: Mechanical(Dimension::STIFFNESS, Sign::NonNegative), "Stiffness; left out: no spring.";
            damping: Mechanical(Dimension::DAMPING, Sign::Any) = "0 N m s/rad", "Viscous damping.";
            friction: Mechanical(Dimension::TORQUE, Sign::NonNegative) = "0 N m", "Coulomb friction.";
            breakaway: Mechanical(Dimension::TORQUE, Sign::NonNegative) as BREAKAWAY;
            stribeck_speed: Mechanical(Dimension::ANGULAR_VELOCITY, Sign::Positive) as STRIBECK_SPEED;
            rest: Mechanical(Dimension::ANGLE, Sign::Any),
                "The angle or distance q1 - q2 at which the spring is relaxed; left out: zero.";
            backlash: Mechanical(Dimension::ANGLE, Sign::NonNegative),
                "Backlash: within half of it either way of `rest` spring and damper transmit nothing, and outside they press and never pull. Left \
                 out: none.";
        }
    }
}

pub(super) const SPRING_DAMPER: Element = Element {
    keyword: SpringDamper::KEYWORD,
    summary: "Spring, viscous damper and Coulomb friction in parallel between two shafts or two masses, or from one to the housing.",
    sketch: r"
                 s
    shaft_1 ===/\/\/\=== shaft_2
            ===[ d ]====
            ===[ c ]====",
    signs: "The twist is q1 - q2 - rest; `<name>.tau` = s twist + d (w1 - w2) acts on shaft_2 forward and on shaft_1 backward; between masses it is \
            the force `<name>.f`.",
    symbol: Symbol::SpringDamper,
    fields: SpringDamper::FIELDS,
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

fn check(values: &Values) -> Vec<KeyError> {
    let mut out = [check_ends(values, ENDS), check_losses(values, values.translational)].concat();
    if values.has("backlash") && !values.exact("stiffness").is_some_and(|s| s.to_f64() > 0.0) {
        out.push(KeyError::new(
            "backlash",
            "without a spring no torque would act outside the backlash",
            "add `stiffness`; rigid stops are an `end_stop`",
        ));
    }
    if values.has("backlash") && values.exact("damping").is_some_and(|d| d.to_f64() < 0.0) {
        out.push(KeyError::new("damping", "with backlash it cannot be negative", "give zero or more"));
    }
    out
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    let direction = Direction::difference(values.word_or_default("shaft_1"), values.word("shaft_2"));
    let mut out = Vec::new();
    if let Some(backlash) = backlash_of(values) {
        let rest = values.exact_or_default("rest");
        let mut friction = losses(&direction, values);
        friction.retain(|term| matches!(term, Term::Friction { .. }));
        return contact(&direction, centred_limits(&rest, backlash), &Side::of(values))
            .into_iter()
            .chain(friction)
            .collect();
    }
    if let Some(stiffness) = values.exact("stiffness").filter(|x| !x.is_zero()) {
        out.push(Term::Spring {
            direction: direction.clone(),
            stiffness: stiffness.clone(),
            rest: values.exact_or_default("rest"),
        });
    }
    out.extend(losses(&direction, values));
    out
}
