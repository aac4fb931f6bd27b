//! Transitions of a state machine whose guards are true together, never or always.

use std::collections::{BTreeMap, HashMap};

use kardan_expr::expr::{AtOnce, Expr, Graph, JointBound, Symbol, at_once};
use kardan_math::num::Rational;
use kardan_math::units::{Exact, shown_quantity};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;

/// A transition as written: the states, its guard, and its place.
#[derive(Clone)]
pub(super) struct TransitionGuard {
    pub transition: kardan_rt::Transition,
    pub when: Expr,
    pub place: Place,
}

/// Known bounds of symbols: those that are not negative, and sums of them that are bounded.
#[derive(Default)]
pub(super) struct Assumptions {
    /// The position of each among the nonnegative ones.
    not_negative: HashMap<Symbol, usize>,
    bounds: Vec<Rational>,
    /// The sums that contain each.
    joint: HashMap<Symbol, Vec<usize>>,
}

impl Assumptions {
    /// Records symbols that are not negative.
    pub fn not_negative(&mut self, symbols: impl IntoIterator<Item = Symbol>) {
        for symbol in symbols {
            let place = self.not_negative.len();
            self.not_negative.entry(symbol).or_insert(place);
        }
    }

    /// Records symbols whose sum is not above a bound.
    pub fn bounded(&mut self, symbols: &[Symbol], bound: Rational) {
        symbols.iter().for_each(|symbol| self.joint.entry(*symbol).or_default().push(self.bounds.len()));
        self.bounds.push(bound);
    }

    /// Whether expressions can exceed a half together, given the bounds of their symbols.
    pub fn at_once(&self, graph: &Graph, exprs: &[Expr]) -> AtOnce {
        let symbols = graph.symbols(exprs);
        let mut not_negative: Vec<Symbol> =
            symbols.iter().copied().filter(|symbol| self.not_negative.contains_key(symbol)).collect();
        not_negative.sort_by_key(|symbol| self.not_negative[symbol]);
        let mut joint: BTreeMap<usize, Vec<Symbol>> = BTreeMap::new();
        for symbol in symbols {
            let sums = self.joint.get(&symbol).into_iter().flatten();
            sums.for_each(|sum| joint.entry(*sum).or_default().push(symbol));
        }
        let joint: Vec<JointBound> =
            joint.into_iter().map(|(sum, symbols)| (symbols, self.bounds[sum].clone())).collect();
        at_once(graph, exprs, &not_negative, &joint)
    }
}

/// Values of signals in words.
fn shown(graph: &Graph, at: &[(Symbol, Rational)]) -> String {
    let one = |(symbol, value): &(Symbol, Rational)| {
        let (name, dimension) = graph.name(*symbol);
        format!("`{name}` = {}", shown_quantity(&Exact::new(value.clone(), 0), dimension))
    };
    at.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Warns of transitions from one state that may be enabled together, and of those that are never taken; of a machine by its name.
pub(super) fn check(
    what: &str,
    (states, guards): (&[String], &[TransitionGuard]),
    (graph, assumptions): (&Graph, &Assumptions),
    out: &mut Vec<Diagnostic>,
) {
    let decided = |exprs: &[Expr]| assumptions.at_once(graph, exprs);
    let mut possible: Vec<&TransitionGuard> = Vec::new();
    for guard in guards {
        if decided(&[guard.when]) == AtOnce::Never {
            let [from, to] = [guard.transition.from, guard.transition.to].map(|state| &states[state]);
            let message =
                format!("{what}: `when` of the transition from `{from}` to `{to}` is never true, so it is never taken");
            let diagnostic =
                Diagnostic::warning("block::unreachable-transition", message).at(&guard.place, "never true");
            out.push(diagnostic.help("check its thresholds, or remove the transition"));
        } else {
            possible.push(guard);
        }
    }
    let mut before: HashMap<usize, Vec<&TransitionGuard>> = HashMap::new();
    for second in &possible {
        let before = before.entry(second.transition.from).or_default();
        for first in before.iter().filter(|first| first.transition.to != second.transition.to) {
            let [from, a, b] =
                [first.transition.from, first.transition.to, second.transition.to].map(|state| &states[state]);
            let (message, word) = match decided(&[first.when, second.when]) {
                AtOnce::Never => continue,
                AtOnce::At(at) if at.is_empty() => (
                    format!(
                        "{what}: the transitions from `{from}` to `{a}` and to `{b}` are always enabled together: the first in the list is taken"
                    ),
                    "enabled together",
                ),
                AtOnce::At(at) => (
                    format!(
                        "{what}: the transitions from `{from}` to `{a}` and to `{b}` are both enabled where {}: the first in the list is taken",
                        shown(graph, &at)
                    ),
                    "enabled together",
                ),
                AtOnce::Unknown => (
                    format!(
                        "{what}: it is not decided whether the transitions from `{from}` to `{a}` and to `{b}` are ever enabled together, as they compare more than sums of signals times constants: where both are, the first in the list is taken"
                    ),
                    "not decided",
                ),
            };
            let diagnostic = Diagnostic::warning("block::overlapping-transitions", message).at(&second.place, word);
            out.push(diagnostic.help(format!(
                "to give the transition to `{a}` priority, add `and not (...)` with its condition to this one"
            )));
        }
        before.push(second);
    }
    unreachable_states(what, (states, guards), &possible, out);
}

/// Warns of unreachable states.
fn unreachable_states(
    what: &str,
    (states, guards): (&[String], &[TransitionGuard]),
    possible: &[&TransitionGuard],
    out: &mut Vec<Diagnostic>,
) {
    let mut ways = vec![Vec::new(); states.len()];
    possible.iter().for_each(|guard| ways[guard.transition.from].push(guard.transition.to));
    let mut of_state: HashMap<usize, &TransitionGuard> = HashMap::new();
    for guard in guards {
        of_state.entry(guard.transition.from).or_insert(guard);
    }
    let (mut reached, mut open) = (vec![false; states.len()], vec![0]);
    while let Some(state) = open.pop() {
        if !std::mem::replace(&mut reached[state], true) {
            open.extend(&ways[state]);
        }
    }
    for (k, state) in states.iter().enumerate().filter(|(k, _)| !reached[*k]) {
        let message =
            format!("{what}: no transitions lead from its initial state `{}` to its state `{state}`", states[0]);
        let guard = of_state.get(&k).copied().or(guards.first());
        let diagnostic = Diagnostic::warning("block::unreachable-state", message)
            .at_optional(guard.map(|guard| &guard.place), "of this machine");
        out.push(diagnostic.help("add a transition, or remove the state"));
    }
}
