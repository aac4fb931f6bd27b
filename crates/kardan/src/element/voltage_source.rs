use super::shared::branch::{FROM, branch, check_branch};
use super::{Element, Values};
use crate::equations::{Direction, InputKind, Motor, Term};
use crate::results::Symbol;
use crate::schema::{ElementKeys, Keys, keys};

keys! {
    /// An ideal voltage source: an input along its own charge.
    element VoltageSource("voltage_source") {
        required {
            from: Node as FROM;
            to: Node, "The positive pole, where a positive current comes out.";
        }
        optional {
        }
    }
}

/// An ideal voltage source: an input along its own charge.
pub const VOLTAGE_SOURCE: Element = Element {
    keyword: VoltageSource::KEYWORD,
    summary: "An ideal voltage source between two nodes of a circuit; events of the scenario set `<name>.v`.",
    sketch: r"
                 v
    from ----- ( - + ) --->--- to
                         i >0",
    signs: "`<name>.v` is the potential of `to` less that of `from`, zero until an event sets it; `<name>.i` leaves at `to`, \
            so that v i is the power that the source gives.",
    symbol: Symbol::Source,
    fields: VoltageSource::FIELDS,
    example: "\
[voltage_source.supply]
from = \"ground\"
to = \"in\"
",
    check: check_branch,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    out.push(Term::Input { along: Direction::shaft(name), kind: InputKind::Motor(Motor::default()) });
    out
}
