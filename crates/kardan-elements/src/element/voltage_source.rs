//! The element `voltage_source` of a circuit.

use super::Element;
use super::shared::branch::{FROM, branch, check_branch};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, InputKind, Motor, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// An ideal voltage source: an input along its own charge.
    element VoltageSource("voltage_source") {
        required {
            from: Node as FROM;
            to: Node, "The positive pole, where a positive current comes out.";
        }
        optional {
            voltage_limit: Quantity(Dimension::VOLTAGE, Sign::Positive),
                "Largest voltage either way; commands beyond it are limited; left out: unlimited.";
        }
    }
}

pub(super) const VOLTAGE_SOURCE: Element = Element {
    keyword: VoltageSource::KEYWORD,
    summary: "An ideal voltage source between two nodes of a circuit; a control law commands `<name>.v`, or events of the scenario set it.",
    sketch: r"
                 v
    from ----- ( - + ) --->--- to
                         i >0",
    signs: "`<name>.v` is the potential of `to` less that of `from`, zero until a law or an event sets it; `<name>.i` leaves at `to`, so that v i \
            is the power that the source delivers.",
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
    let motor = Motor { torque_limit: values.exact("voltage_limit").cloned(), ..Motor::default() };
    out.push(Term::Input { direction: Direction::shaft(name), kind: InputKind::Motor(motor) });
    out
}
