//! The element `transformer` of a circuit.

use super::shared::branch::{branch, check_winding};
use super::{Element, KeyError};
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Direction, Term};
use kardan_results::Symbol;
use kardan_schema::schema::{ElementKeys, Keys, Sign, Values, keys};

keys! {
    /// An ideal transformer: the gear of a circuit.
    element Transformer("transformer") {
        required {
            from_1: Node, "The dotted end of winding 1.";
            to_1: Node, "The other end of winding 1.";
            from_2: Node, "The dotted end of winding 2.";
            to_2: Node, "The other end of winding 2.";
            ratio: Number(Sign::NonZero),
                "n: turns of winding 1 for one turn of winding 2; negative if one of them has the opposite sense.";
        }
    }
}

pub(super) const TRANSFORMER: Element = Element {
    keyword: Transformer::KEYWORD,
    summary: "An ideal transformer, two coupled windings: v1 = n v2 and n i1 + i2 = 0.",
    sketch: r"
              i1 >0   i2 >0
    from_1 --->---* | *---<--- from_2
           v1     ) | (     v2
      to_1 -------) | (------- to_2
                  n : 1",
    signs: "Both currents count positive into the dotted ends `from_1` and `from_2`, both voltages from there to `to_1` and \
            `to_2`: `<name>.1.i`, `<name>.1.v` and `<name>.2.i`, `<name>.2.v`. It has no inductance of its own and \
            transforms direct current too; put an inductor beside winding 1 for the magnetising current.",
    symbol: Symbol::Transformer,
    fields: Transformer::FIELDS,
    example: "\
[transformer.step_down]
from_1 = \"mains\"
to_1 = \"ground\"
from_2 = \"out\"
to_2 = \"ground\"
ratio = \"10/3\"
",
    check,
    terms,
};

fn check(values: &Values) -> Vec<KeyError> {
    [check_winding(values, ["from_1", "to_1"]), check_winding(values, ["from_2", "to_2"])].concat()
}

fn terms(name: &str, values: &Values) -> Vec<Term> {
    let [first, second] = [format!("{name}.1"), format!("{name}.2")];
    let ratio = values.ratio();
    let mut out = branch(&first, values, ["from_1", "to_1"]);
    out.extend(branch(&second, values, ["from_2", "to_2"]));
    let direction = Direction { entries: vec![(first, ratio), (second, Exact::one())] };
    out.push(Term::Constraint { direction, offset: Exact::zero() });
    out
}
