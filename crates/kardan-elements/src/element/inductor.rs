//! The element `inductor` of a circuit.

use super::Element;
use super::shared::branch::{FROM, TO, branch, check_branch};
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A coil: the inertia of a circuit, \[diss. Table 4.3\].
    element Inductor("inductor") {
        required {
            from: Node as FROM;
            to: Node as TO;
            inductance: Quantity(Dimension::INDUCTANCE, Sign::Positive),
                "Inductance L.";
        }
    }
}

pub(super) const INDUCTOR: Element = Element {
    keyword: Inductor::KEYWORD,
    summary: "An ideal coil between two nodes of a circuit: v = L di/dt.",
    sketch: r"
           i >0   L
    from --->---UUUU------- to
           +     v      -",
    signs: "`<name>.q` and `<name>.i` count positive from `from` to `to`; `<name>.v` is the potential of `from` less that \
            of `to`.",
    symbol: Symbol::Inductor,
    fields: Inductor::FIELDS,
    example: "\
[inductor.choke]
from = \"in\"
to = \"out\"
inductance = \"2 mH\"
",
    check: check_branch,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    if let Some(inductance) = values.exact("inductance") {
        out.push(Term::Inertia { direction: Direction::shaft(name), inertia: inductance.clone() });
    }
    out
}
