//! Transitions of a state machine whose guards hold at once, never or always.

use std::collections::BTreeSet;

use crate::diagnostics::Diagnostic;
use crate::entries::Place;
use crate::expr::{AtOnce, Expr, Graph, Symbol, Together, at_once};
use crate::num::Rational;
use crate::units::{Exact, shown_quantity};

/// A transition as it is written: the states, what it depends on, and where that stands.
#[derive(Clone)]
pub(super) struct WrittenGuard {
    pub transition: kardan_rt::Transition,
    pub when: Expr,
    pub place: Place,
}

/// What is known of symbols: those that are not negative, and sums of them that are bounded.
#[derive(Default)]
pub(super) struct Known {
    pub not_negative: Vec<Symbol>,
    pub together: Vec<Together>,
}

/// Values of signals in words.
fn shown(graph: &Graph, at: &[(Symbol, Rational)]) -> String {
    let one = |(symbol, value): &(Symbol, Rational)| {
        let (name, dimension) = graph.name(*symbol);
        format!("`{name}` = {}", shown_quantity(&Exact::new(value.clone(), 0), dimension))
    };
    at.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Warns of transitions out of one state that may be taken at once, and of those that are never taken; of a machine by its name.
pub(super) fn check(
    what: &str,
    (states, guards): (&[String], &[WrittenGuard]),
    (graph, known): (&Graph, &Known),
    out: &mut Vec<Diagnostic>,
) {
    let decided = |exprs: &[Expr]| at_once(graph, exprs, &known.not_negative, &known.together);
    let mut possible: Vec<&WrittenGuard> = Vec::new();
    for guard in guards {
        if decided(&[guard.when]) == AtOnce::Never {
            let [from, to] = [guard.transition.from, guard.transition.to].map(|state| &states[state]);
            let message =
                format!("{what}: `when` of the way from `{from}` to `{to}` never holds, so it is never taken");
            let told = Diagnostic::warning("block::transition", message).at(guard.place.clone(), "never holds");
            out.push(told.help("check its thresholds, or take the transition out"));
        } else {
            possible.push(guard);
        }
    }
    for (k, second) in possible.iter().enumerate() {
        for first in &possible[..k] {
            if first.transition.from != second.transition.from || first.transition.to == second.transition.to {
                continue;
            }
            let [from, a, b] =
                [first.transition.from, first.transition.to, second.transition.to].map(|state| &states[state]);
            let (message, word) = match decided(&[first.when, second.when]) {
                AtOnce::Never => continue,
                AtOnce::At(at) if at.is_empty() => (
                    format!(
                        "{what}: the ways from `{from}` to `{a}` and to `{b}` are both open whatever happens: the first in the list is taken"
                    ),
                    "open at once",
                ),
                AtOnce::At(at) => (
                    format!(
                        "{what}: the ways from `{from}` to `{a}` and to `{b}` are both open where {}: the first in the list is taken",
                        shown(graph, &at)
                    ),
                    "open at once",
                ),
                AtOnce::Unknown => (
                    format!(
                        "{what}: whether the ways from `{from}` to `{a}` and to `{b}` are ever open at once is not decided, as they compare more than sums of signals times constants: where both are, the first in the list is taken"
                    ),
                    "not decided",
                ),
            };
            let told = Diagnostic::warning("block::overlap", message).at(second.place.clone(), word);
            out.push(told.help(format!(
                "to say that the way to `{a}` comes first, write `and not (...)` with its condition into this one"
            )));
        }
    }
    unreachable_states(what, (states, guards), &possible, out);
}

/// Warns of states that no way leads to.
fn unreachable_states(
    what: &str,
    (states, guards): (&[String], &[WrittenGuard]),
    possible: &[&WrittenGuard],
    out: &mut Vec<Diagnostic>,
) {
    let mut reached: BTreeSet<usize> = BTreeSet::from([0]);
    loop {
        let before = reached.len();
        let open = possible.iter().map(|guard| guard.transition).filter(|way| reached.contains(&way.from));
        let next: Vec<usize> = open.map(|way| way.to).collect();
        reached.extend(next);
        if reached.len() == before {
            break;
        }
    }
    for (k, state) in states.iter().enumerate().filter(|(k, _)| !reached.contains(k)) {
        let message = format!("{what}: no way leads from `{}`, where it starts, to its state `{state}`", states[0]);
        let told = Diagnostic::warning("block::state", message);
        let place = guards.iter().find(|guard| guard.transition.from == k).or(guards.first());
        let told = place.into_iter().fold(told, |told, guard| told.at(guard.place.clone(), "of this machine"));
        out.push(told.help("add a transition, or take the state out"));
    }
}
