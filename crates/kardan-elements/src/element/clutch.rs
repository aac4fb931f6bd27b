//! The element `clutch`: friction between two shafts with a torque from a signal.

use super::shared::gear_loss::check_loss;
use super::shared::shafts::{ENDS, check_ends};
use super::{Element, KeyError};
use kardan_math::units::{Dimension, Exact};
use kardan_mechanics::equations::{Direction, Term, UnilateralConstraint};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Field, Keys, Kind, Sign, Values, keys};

keys! {
    /// A friction clutch between two shafts, whose torque follows from a signal.
    element Clutch("clutch") {
        required {
            shaft_1: Body, "The first shaft or mass.";
            shaft_2: Body, "The second.";
            torque: Formula(Dimension::TORQUE),
                "The Coulomb torque while it slips, not negative: an expression of signals `[signal.NAME]`, the time `t`, parameters, angles and \
                 speeds; such as \"mu * radius * pressed\" with the force of a signal.";
        }
        optional {
            static_factor: Number(Sign::Positive) as STATIC_FACTOR;
        }
    }
}

pub(super) const STATIC_FACTOR: Field = Field::optional(
    "static_factor",
    Kind::Number(Sign::Positive),
    "While it sticks it transmits up to this factor times that torque, at least 1; left out: 1.",
);

pub(super) const CLUTCH: Element = Element {
    keyword: Clutch::KEYWORD,
    summary: "Friction clutch: Coulomb friction between two shafts with a torque that a signal commands; it sticks exactly, without creep.",
    sketch: r"
    shaft_1 ===| |=== shaft_2
               ^ torque(t)",
    signs: "`<name>.tau` acts on shaft_2 forward and on shaft_1 backward; while the clutch slips it opposes w1 - w2.",
    symbol: Symbol::Clutch,
    fields: Clutch::FIELDS,
    example: "\
[clutch.launch]
shaft_1 = \"engine\"
shaft_2 = \"gearbox\"
torque = \"200 N m * (1 - exp(-t/(0.2 s)))\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    let own = [check_ends(values, ENDS), check_static_factor(values)].concat();
    own.into_iter().chain(check_loss(values, "torque")).collect()
}

pub(super) fn check_static_factor(values: &Values) -> Vec<KeyError> {
    let low = values.exact("static_factor").is_some_and(|factor| factor.to_f64() < 1.0);
    let key_error = || {
        KeyError::new("static_factor", "below 1 the friction would be less at rest than in motion", "give at least 1")
    };
    low.then(key_error).into_iter().collect()
}

/// Friction of a commanded torque along a direction.
pub(super) fn pressed(direction: Direction, values: &Values) -> Vec<Term> {
    let Some(torque) = values.formula("torque") else { return Vec::new() };
    let at_rest = values.exact("static_factor").cloned().unwrap_or_else(Exact::one);
    vec![Term::UnilateralConstraint {
        direction,
        unilateral: UnilateralConstraint::Friction { torque: torque.clone(), at_rest },
    }]
}

fn terms(_: &str, values: &Values) -> Vec<Term> {
    pressed(Direction::difference(values.word_or_default("shaft_1"), values.word("shaft_2")), values)
}
