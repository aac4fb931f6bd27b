use super::{Element, Values};
use crate::equations::{Direction, InputKind, Term};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, keys};

keys! {
    /// A torque from outside, set by the scenario and unknown to the laws.
    element Disturbance("disturbance") {
        required {
            shaft: Shaft, "The shaft that the torque acts on.";
        }
        optional {
        }
    }
}

/// A torque from outside, set by the scenario and unknown to the laws.
pub const DISTURBANCE: Element = Element {
    keyword: Disturbance::KEYWORD,
    summary: "A torque from outside on a shaft; events of the scenario set it, control laws do not know it.",
    sketch: r"
    road --> tau on shaft",
    signs: "Positive in the sense of the shaft's angle; the signal carries the element's own name.",
    symbol: Symbol::Torque,
    fields: Disturbance::FIELDS,
    example: "\
[disturbance.T_dist]
shaft = \"rk\"
",
    check: |_| Vec::new(),
    terms,
};

fn terms(_: &str, values: &Values) -> Vec<Term> {
    vec![Term::Input { along: Direction::shaft(values.word_or_default("shaft")), kind: InputKind::Disturbance }]
}
