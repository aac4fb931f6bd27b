//! The element `disturbance`: an external torque or force.

use super::Element;
use super::shared::straight::check_moves;
use kardan_mechanics::equations::{Direction, InputKind, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Values, keys};

keys! {
    /// An external torque or force, set by the scenario and unknown to the laws.
    element Disturbance("disturbance") {
        required {
            shaft: Body, "The shaft that the torque acts on, or the mass that the force acts on.";
        }
    }
}

pub(super) const DISTURBANCE: Element = Element {
    keyword: Disturbance::KEYWORD,
    summary: "An external torque on a shaft, or a force on a mass; events of the scenario set it, control laws do not use it.",
    sketch: r"
    road --> tau on shaft",
    signs: "Positive in the sense of the angle or position; the signal has the name of the element.",
    symbol: Symbol::Torque,
    fields: Disturbance::FIELDS,
    example: "\
[disturbance.T_dist]
shaft = \"rk\"
",
    check: |values| check_moves(values, &["shaft"]),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    vec![Term::Input { direction: Direction::shaft(values.word_or_default("shaft")), kind: InputKind::Disturbance }]
}
