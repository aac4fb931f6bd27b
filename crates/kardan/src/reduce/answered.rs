//! Torques and locks that follow from what blocks answer, around a position at rest.

use super::law_slopes::unconstrained;
use super::{Kinematics, Motion, OperatingPoint, Reduced};
use crate::assemble::Along;
use crate::equations::{Formula, Hold, Meaning};
use crate::expr::{Expr, Floating, Symbol, lower};
use crate::num::rational_to_f64;
use std::sync::Arc;

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
    let (n, free) = (reduced.equations.coordinates.len(), unconstrained(reduced));
    let mut numeric = Kinematics::new(reduced);
    numeric.update(&point.position, &point.rates);
    let of = |law: &Along<Arc<Formula>>| {
        let mut around = Around::new(&free, &law.value, &numeric);
        let (graph, value) = (&mut around.motion.graph, around.value);
        let used = graph.symbols(&[value]);
        let slopes: Vec<Expr> = used.iter().map(|symbol| graph.derivative(value, *symbol)).collect();
        let [there, without] = [answer, &|_: &str| 0.0].map(|answer| around.at(&slopes, answer));
        let Motion { graph, symbols, timed, .. } = &around.motion;
        let row = law.row.iter().map(|(shaft, x)| (*shaft, rational_to_f64(x))).collect();
        let (mut on_answers, mut on_positions, mut on_rates) = (Vec::new(), Vec::new(), Vec::new());
        for (k, symbol) in used.iter().enumerate() {
            let block = timed.blocks.iter().find(|(_, own)| graph.symbol_of(*own) == Some(*symbol));
            if let Some((name, _)) = block {
                on_answers.push((name.clone(), there[k]));
            } else if let Some(place) = symbols.iter().position(|own| own == symbol).filter(|_| there[k] != without[k])
            {
                let of = if place < n { &mut on_positions } else { &mut on_rates };
                of.push((place % n, there[k] - without[k]));
            }
        }
        AnsweredTorque { element: law.element.clone(), row, on_answers, on_positions, on_rates }
    };
    reduced.equations.laws.iter().filter(|law| is_answered(&law.value)).map(of).collect()
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
