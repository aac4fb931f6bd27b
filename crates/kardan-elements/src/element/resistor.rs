//! The element `resistor` of a circuit.

use super::Element;
use super::shared::branch::{FROM, TO, branch, check_branch};
use super::shared::losses::damper;
use kardan_math::units::Dimension;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// A resistor: the damper of a circuit, \[diss. Table 4.3\].
    element Resistor("resistor") {
        required {
            from: Node as FROM;
            to: Node as TO;
            resistance: Quantity(Dimension::RESISTANCE, Sign::NonNegative),
                "Resistance R.";
        }
    }
}

pub(super) const RESISTOR: Element = Element {
    keyword: Resistor::KEYWORD,
    summary: "An ohmic resistor between two nodes of a circuit: v = R i; with no resistance a wire that shows its current.",
    sketch: r"
           i >0   R
    from --->---[   ]------ to
           +      v     -",
    signs: "`<name>.q` and `<name>.i` count positive from `from` to `to`; `<name>.v` is the potential of `from` less that \
            of `to`.",
    symbol: Symbol::Resistor,
    fields: Resistor::FIELDS,
    example: "\
[resistor.load]
from = \"out\"
to = \"ground\"
resistance = \"50 Ohm\"
",
    check: check_branch,
    terms,
};

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let mut out = branch(name, values, ["from", "to"]);
    out.extend(damper(&Direction::shaft(name), values.exact("resistance")));
    out
}
