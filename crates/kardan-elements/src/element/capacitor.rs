//! The element `capacitor` of a circuit.

use super::Element;
use super::shared::branch::{FROM, TO, branch, check_branch};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A capacitor: the spring of a circuit with the elastance 1/C, \[diss. Table 4.3\].
    element Capacitor("capacitor") {
        required {
            from: Node as FROM;
            to: Node as TO;
            capacitance: Quantity(Dimension::CAPACITANCE, Sign::Positive),
                "Capacitance C.";
        }
        optional {
            initial_voltage: Quantity(Dimension::VOLTAGE, Sign::Any) = "0 V",
                "v0, the voltage while `<name>.q` is zero, as it is at the start.";
        }
    }
}

pub(super) const CAPACITOR: Element = Element {
    keyword: Capacitor::KEYWORD,
    summary: "An ideal capacitor between two nodes of a circuit: v = v0 + q/C.",
    sketch: r"
           i >0   C
    from --->----| |------- to
           +      v     -",
    signs: "`<name>.q` and `<name>.i` count positive from `from` to `to`; `<name>.v` is the potential of `from` less that of `to`. `<name>.q` is \
            the charge that has flowed through: with `initial_voltage` the charge of the plates is C v0 more.",
    symbol: Symbol::Capacitor,
    fields: Capacitor::FIELDS,
    example: "\
[capacitor.buffer]
from = \"out\"
to = \"ground\"
capacitance = \"10 uF\"
",
    check: check_branch,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    let capacitance = values.exact("capacitance");
    if let (Some(capacitance), Some(stiffness)) = (capacitance, capacitance.and_then(|c| c.recip())) {
        let rest = -&(capacitance * &values.exact_or_default("initial_voltage"));
        out.push(Term::Spring { direction: Direction::shaft(name), stiffness, rest });
    }
    out
}
