//! Torques and locks that follow from what blocks answer, around a position at rest.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::law_slopes::unconstrained;
use super::{Kinematics, Motion, OperatingPoint, Reduced, law_slopes_with};
use crate::equations::{Formula, Hold, Meaning};
use crate::expr::{Expr, Floating, Symbol, lower};
use crate::num::{Rational, SparseRow, rational_to_f64};

/// A torque that follows from what blocks answer: what it has more than where they answer zero, to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct AnsweredTorque {
    /// The element.
    pub element: String,
    /// The direction along which it acts, over the shafts.
    pub row: Vec<(usize, f64)>,
    /// Its slopes by what blocks answer, N m for each unit.
    pub on_answers: Vec<(String, f64)>,
    /// What its slopes by angles have more, N m/rad, of those where that is not zero.
    pub on_positions: Vec<(usize, f64)>,
    /// The same by speeds, N m s/rad.
    pub on_rates: Vec<(usize, f64)>,
    /// What vanishes where it has a kink, and where it jumps, with these answers.
    pub kinks: [Vec<String>; 2],
}

/// A formula in a motion whose blocks are symbols.
struct Around<'a> {
    motion: Motion,
    value: Expr,
    numeric: &'a Kinematics,
}

impl<'a> Around<'a> {
    fn new(free: &Reduced, formula: &Formula, numeric: &'a Kinematics) -> Self {
        let mut motion = Motion::kinematics(free, false);
        let value = motion.formula(free, formula);
        Self { motion, value, numeric }
    }

    /// Values of expressions at time zero, with what blocks answer.
    fn at(&self, exprs: &[Expr], answer: &dyn Fn(&str) -> f64) -> Vec<f64> {
        let Motion { graph, symbols, timed, .. } = &self.motion;
        let begin: Vec<f64> = timed.values(0.0).collect();
        let given = timed.symbols(graph);
        let of = |symbol: Symbol| {
            let block = timed.blocks.iter().find(|(_, own)| graph.symbol_of(*own) == Some(symbol));
            if let Some((name, _)) = block {
                return answer(name);
            }
            let moving = self.numeric.angles.iter().chain(&self.numeric.speeds);
            match symbols.iter().position(|own| *own == symbol) {
                Some(place) => moving.into_iter().nth(place).copied().unwrap_or(0.0),
                None => given.iter().position(|own| *own == symbol).map_or(0.0, |place| begin[place]),
            }
        };
        lower(graph, exprs, &mut Floating::<f64>::default(), of)
    }
}

/// Whether a formula follows from what blocks answer.
pub fn is_answered(formula: &Formula) -> bool {
    formula.all_names().into_iter().any(|(_, meaning)| matches!(meaning, Meaning::Block(..)))
}

/// The torques that follow from blocks, at an operating point, with what they answer there.
///
/// # Panics
/// If the point has not one entry per coordinate.
pub fn answered_torques(
    reduced: &Reduced,
    point: &OperatingPoint,
    answer: &dyn Fn(&str) -> f64,
) -> Vec<AnsweredTorque> {
    if !reduced.equations.laws.iter().any(|law| is_answered(&law.value)) {
        return Vec::new();
    }
    let of = |answer| law_slopes_with(reduced, point, &is_answered, answer);
    let slopes = of(Some(answer)).into_iter().zip(of(None));
    let more = |with: &SparseRow, without: &SparseRow| -> Vec<(usize, f64)> {
        let mut sum: BTreeMap<usize, Rational> = with.iter().cloned().collect();
        without.iter().for_each(|(place, x)| *sum.entry(*place).or_default() -= x);
        sum.into_iter().filter(|(_, x)| !x.is_zero()).map(|(place, x)| (place, rational_to_f64(&x))).collect()
    };
    slopes
        .map(|(with, without)| AnsweredTorque {
            element: with.element,
            row: with.row.iter().map(|(shaft, x)| (*shaft, rational_to_f64(x))).collect(),
            on_answers: with.on_answers,
            on_positions: more(&with.on_positions, &without.on_positions),
            on_rates: more(&with.on_rates, &without.on_rates),
            kinks: [with.kinks, with.jumps],
        })
        .collect()
}

/// The locks that follow from blocks and are engaged with what these answer at rest at an operating point.
///
/// # Panics
/// As [`answered_torques`].
pub fn answered_locks(reduced: &Reduced, point: &OperatingPoint, answer: &dyn Fn(&str) -> f64) -> Vec<String> {
    let free = unconstrained(reduced);
    let mut numeric = Kinematics::new(reduced);
    numeric.update(&point.position, &point.rates);
    let locks = reduced.equations.holds.iter().filter_map(|hold| match &hold.value {
        Hold::Lock { engaged } if is_answered(engaged) => Some((&hold.element, engaged)),
        _ => None,
    });
    let engaged = |(element, formula): (&String, &Arc<Formula>)| {
        let around = Around::new(&free, formula, &numeric);
        (around.at(&[around.value], answer)[0] > 0.5).then(|| element.clone())
    };
    locks.filter_map(engaged).collect()
}
