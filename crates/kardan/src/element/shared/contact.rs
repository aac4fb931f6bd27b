//! Stops on the two sides of a direction.

use super::kind::Mistake;
use super::values::Values;
use crate::equations::{Direction, Hold, Term};
use crate::units::Exact;

/// A direction between a lower and an upper stop: soft ones if there is a `stiffness`, else rigid ones with their `restitution`.
pub(in crate::element) fn contact(along: &Direction, [lower, upper]: [Option<Exact>; 2], values: &Values) -> Vec<Term> {
    let hold = |upper: bool, offset: Exact| match values.exact("stiffness") {
        Some(stiffness) => {
            Hold::Cushion { upper, offset, stiffness: stiffness.clone(), damping: values.exact_or_default("damping") }
        }
        None => Hold::Stop { upper, offset, restitution: values.exact_or_default("restitution") },
    };
    let lower = lower.map(|offset| Term::Hold { along: along.clone(), hold: hold(false, offset) });
    let upper = upper.map(|offset| Term::Hold { along: opposite(along), hold: hold(true, -&offset) });
    lower.into_iter().chain(upper).collect()
}

/// A direction the other way round.
pub(in crate::element) fn opposite(along: &Direction) -> Direction {
    Direction { entries: along.entries.iter().map(|(name, x)| (name.clone(), -x)).collect() }
}

/// What is wrong with the keys of [`contact`]; `sides` is the key that says where the stops are.
pub(in crate::element) fn check_contact(values: &Values, sides: &'static str) -> Vec<Mistake> {
    let mut out = Vec::new();
    if values.exact("restitution").is_some_and(|e| e.to_f64() > 1.0) {
        out.push(Mistake::new(
            "restitution",
            "above 1 each blow would add energy",
            "give a number from 0 (it stays) to 1 (it loses nothing)",
        ));
    }
    let soft = values.has("stiffness");
    if soft && values.exact("restitution").is_some_and(|e| !e.is_zero()) {
        out.push(Mistake::new(
            "restitution",
            "it is for rigid contact, and `stiffness` makes it soft",
            "take one of the two away; a soft one loses energy by its `damping`",
        ));
    }
    if !soft && values.exact("damping").is_some_and(|d| !d.is_zero()) {
        let message = format!("it is for soft contact at `{sides}`, and without `stiffness` it is rigid");
        out.push(Mistake::new("damping", message, "add `stiffness`, or give `restitution` in place of it"));
    }
    out
}
