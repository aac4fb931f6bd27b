use super::{Element, FROM, TO, Values, branch, check_branch};
use crate::equations::{Direction, Term};
use crate::schema::{Field, Kind, Sign};
use crate::units::Dimension;

/// A capacitor: the spring of a circuit with the elastance 1/C, \[diss. Table 4.3\].
pub const CAPACITOR: Element = Element {
    keyword: "capacitor",
    summary: "An ideal capacitor between two nodes of a circuit: v = v0 + q/C.",
    sketch: r"
           i >0   C
    from --->----| |------- to
           +      v     -",
    signs: "`<name>.q` and `<name>.i` count positive from `from` to `to`; `<name>.v` is the potential of `from` less that \
            of `to`. `<name>.q` is the charge that has gone through: with `initial_voltage` the plates hold C v0 more.",
    fields: &[
        FROM,
        TO,
        Field::required("capacitance", Kind::Quantity(Dimension::CAPACITANCE, Sign::Positive), "Capacitance C."),
        Field::optional(
            "initial_voltage",
            Kind::Quantity(Dimension::VOLTAGE, Sign::Any),
            "v0, the voltage while `<name>.q` is zero, as it is at the start; left out: zero.",
        ),
    ],
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
        let rest = -&(capacitance * &values.exact_or_zero("initial_voltage"));
        out.push(Term::Spring { along: Direction::shaft(name), stiffness, rest });
    }
    out
}
