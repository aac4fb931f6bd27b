//! Constraints enforced by multipliers, in the written equations.

use std::collections::BTreeMap;

use crate::study::PreparedVariant;
use crate::study::equations::latex_lines::index;
use crate::study::read::state_names::scaled_term;
use kardan_expr::expr::{Expr, OfTime, Style, parenthesised, printed};
use kardan_math::names::{SignedTerm, signed_sum};
use kardan_math::num::rational_to_f64;
use kardan_mechanics::equations::{Domain, MultiplierLaw};
use kardan_mechanics::reduce::Motion;

/// A multiplier constraint as text.
pub(in crate::study) struct MultiplierLine {
    pub(in crate::study) element: String,
    /// Its term in the equation of each reduced coordinate, with its sign; empty if it has none.
    pub(in crate::study) shares: Vec<Option<SignedTerm>>,
    /// The constraint itself: a relation of positions, speeds or accelerations.
    pub(in crate::study) equation: String,
}

/// A function of time as in the file.
pub(in crate::study) fn of_time(function: &OfTime, style: Style) -> String {
    let name = |name: &str| match style {
        Style::Latex if name != "t" => index(name),
        _ => name.to_string(),
    };
    function.formatted(style, &name)
}

/// All multiplier constraints of a variant at time zero; `mark` writes names as in the other equations.
pub(in crate::study) fn multiplier_lines(
    variant: &PreparedVariant,
    style: Style,
    mark: &dyn Fn(&str, usize) -> String,
) -> Vec<MultiplierLine> {
    let reduced = &variant.reduced;
    let equations = &reduced.equations;
    if equations.multiplier_constraints.is_empty() {
        return Vec::new();
    }
    let motion = Motion::at_time_zero(reduced);
    let (r, first) = (reduced.degrees_of_freedom(), equations.set_valued().count());
    let place = motion.symbols.iter().zip(&reduced.coordinates);
    let place: BTreeMap<&str, &str> =
        place.map(|(symbol, shaft)| (motion.graph.name(*symbol).0, equations.coordinates[*shaft].as_str())).collect();
    let formatted = |expr: Expr| {
        printed(&motion.graph, expr, style, &|name| place.get(name).map_or_else(|| name.into(), |name| mark(name, 0)))
    };
    let term = |expr: Expr, of: &str| match motion.graph.number_of(expr).map(rational_to_f64) {
        Some(number) => scaled_term(number, of),
        None => product(&formatted(expr), style, of),
    };
    let line = |(k, constraint): (usize, &kardan_mechanics::assemble::MultiplierConstraint)| {
        let multiplier = mark(&constraint.element, equations.domain_of_multiplier(constraint).map_or(9, effort_mark));
        let direction = &motion.frictions[first + k];
        let shares = (0..r).map(|i| direction.get(&i).map(|entry| term(*entry, &multiplier))).collect();
        let left_side = |order: usize| {
            let row = motion.multiplier_constraints[k].row.iter();
            signed_sum(row.map(|(shaft, entry)| term(*entry, &mark(&equations.coordinates[*shaft], order))))
        };
        let equation = match (&constraint.law, motion.multiplier_constraints[k].position) {
            (MultiplierLaw::Surface(_), Some(position)) => format!("{} = 0", formatted(position)),
            (MultiplierLaw::Prescribed { order, function, .. }, _) => {
                format!("{} = {}", left_side(*order), of_time(function, style))
            }
            _ => format!("{} = 0", left_side(1)),
        };
        MultiplierLine { element: constraint.element.clone(), shares, equation }
    };
    equations.multiplier_constraints.iter().enumerate().map(line).collect()
}

/// How a torque, a force, a voltage or a rate is marked.
pub(in crate::study) fn effort_mark(domain: Domain) -> usize {
    match domain {
        Domain::Rotation => 3,
        Domain::Number => 5,
        Domain::Charge => 6,
        Domain::Translation => 7,
    }
}

/// A coefficient in text form, times a factor.
fn product(coefficient: &str, style: Style, of: &str) -> SignedTerm {
    let mut depth = 0i32;
    let is_sum = coefficient.char_indices().any(|(at, c)| {
        depth += i32::from("([{".contains(c)) - i32::from(")]}".contains(c));
        depth == 0 && at > 0 && (coefficient[at..].starts_with(" + ") || coefficient[at..].starts_with(" - "))
    });
    match (is_sum, coefficient.strip_prefix('-'), style) {
        (true, _, Style::Text) => (false, format!("({coefficient}) {of}")),
        (true, _, Style::Latex) => (false, format!("{} {of}", parenthesised(coefficient))),
        (false, Some(rest), _) => (true, format!("{} {of}", rest.trim_start())),
        (false, None, _) => (false, format!("{coefficient} {of}")),
    }
}
