//! Branches of a circuit, between two nodes.

use super::kind::KeyError;
use super::shafts::shared_name;
use kardan_math::units::Exact;
use kardan_mechanics::equations::{Direction, Domain, Term};
use kardan_schema::schema::{Field, Kind, Values};

pub(in crate::element) const FROM: Field =
    Field::required("from", Kind::Node, "The node that a positive current leaves.");
pub(in crate::element) const TO: Field =
    Field::required("to", Kind::Node, "The node that a positive current enters; `ground` is at 0 V.");

/// A branch of a circuit: its charge, and the charge's share in the balances of the nodes at both ends.
pub(in crate::element) fn branch(charge: &str, values: &Values, [from, to]: [&str; 2]) -> Vec<Term> {
    let share = |key: &str, sign: i64| {
        let direction = Direction { entries: vec![(charge.to_string(), Exact::from_integer(sign))] };
        values.word(key).map(|node| Term::Balance { node: node.into(), direction })
    };
    let declared = Term::Coordinate { name: charge.to_string(), domain: Domain::Charge };
    std::iter::once(declared).chain(share(from, 1)).chain(share(to, -1)).collect()
}

/// The ends of a branch must be two nodes.
pub(in crate::element) fn check_branch(values: &Values) -> Vec<KeyError> {
    check_winding(values, ["from", "to"])
}

/// The same of a winding.
pub(in crate::element) fn check_winding(values: &Values, [from, to]: [&'static str; 2]) -> Vec<KeyError> {
    let error = |node| {
        let message = format!("both ends are the node `{node}`, so it has no part in the circuit");
        KeyError::new(to, message, "name two different nodes")
    };
    shared_name(values, [from, to]).map(error).into_iter().collect()
}
