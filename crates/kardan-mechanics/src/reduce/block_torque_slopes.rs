//! Slopes of torques and locks that depend on block outputs, around a position at rest.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::{Kinematics, Motion, OperatingPoint, Reduced, law_slopes_with};
use crate::assemble::row_f64;
use crate::equations::{Formula, UnilateralConstraint};
use kardan_expr::expr::{Floating, Symbol, lower};
use kardan_math::num::{Rational, SparseRow, rational_to_f64};

/// A torque that depends on block outputs: its difference from the value at zero outputs, to first order.
#[derive(Debug, Clone, PartialEq)]
pub struct BlockTorque {
    /// The element.
    pub element: String,
    /// The direction in which it acts, over the shafts.
    pub row: Vec<(usize, f64)>,
    /// Its slopes by block outputs, N m for each unit.
    pub on_outputs: Vec<(String, f64)>,
    /// The change of its slopes by angles, N m/rad, where that is not zero.
    pub on_positions: Vec<(usize, f64)>,
    /// The same by speeds, N m s/rad.
    pub on_rates: Vec<(usize, f64)>,
    /// The expressions that vanish where it has a kink, and where it jumps, at these outputs.
    pub kinks: [Vec<String>; 2],
}

/// The value of a formula at angles and speeds of all coordinates, at time zero, with given block outputs.
fn value_with_blocks(
    (free, mut motion): (&Reduced, Motion),
    formula: &Formula,
    numeric: &Kinematics,
    output: &dyn Fn(&str) -> f64,
) -> f64 {
    let value = motion.formula(free, formula);
    let Motion { graph, symbols, timed, .. } = &motion;
    let begin: Vec<f64> = timed.values(0.0).collect();
    let time_symbols = timed.symbols(graph);
    let of = |symbol: Symbol| {
        let block = timed.blocks.iter().find(|(_, own)| graph.symbol_of(*own) == Some(symbol));
        if let Some((name, _)) = block {
            return output(name);
        }
        match symbols.iter().position(|own| *own == symbol) {
            Some(place) => numeric.angles.iter().chain(&numeric.speeds).nth(place).copied().unwrap_or(0.0),
            None => time_symbols.iter().position(|own| *own == symbol).map_or(0.0, |place| begin[place]),
        }
    };
    lower(graph, &[value], &mut Floating::<f64>::default(), of)[0]
}

/// Whether a formula depends on block outputs.
pub fn reads_blocks(formula: &Formula) -> bool {
    formula.blocks().next().is_some()
}

/// The torques that depend on blocks, at an operating point, with the block outputs there.
///
/// # Panics
/// If the point has not one entry per coordinate.
pub fn block_torques(reduced: &Reduced, point: &OperatingPoint, output: &dyn Fn(&str) -> f64) -> Vec<BlockTorque> {
    if !reduced.equations.laws.iter().any(|law| reads_blocks(&law.value)) {
        return Vec::new();
    }
    let of = |output| law_slopes_with(reduced, point, &reads_blocks, output);
    let slopes = of(Some(output)).into_iter().zip(of(None));
    let more = |with: &SparseRow, base: &SparseRow| -> Vec<(usize, f64)> {
        let mut sum: BTreeMap<usize, Rational> = with.iter().cloned().collect();
        base.iter().for_each(|(place, x)| *sum.entry(*place).or_default() -= x);
        sum.into_iter().filter(|(_, x)| !x.is_zero()).map(|(place, x)| (place, rational_to_f64(&x))).collect()
    };
    slopes
        .map(|(with, base)| BlockTorque {
            element: with.element,
            row: row_f64(&with.row),
            on_outputs: with.on_outputs,
            on_positions: more(&with.on_positions, &base.on_positions),
            on_rates: more(&with.on_rates, &base.on_rates),
            kinks: [with.kinks, with.jumps],
        })
        .collect()
}

/// The locks that depend on blocks and are engaged by the block outputs at rest at an operating point.
///
/// # Panics
/// As [`block_torques`].
pub fn block_locks(reduced: &Reduced, point: &OperatingPoint, output: &dyn Fn(&str) -> f64) -> Vec<String> {
    let (free, motion) = Motion::free(&reduced.equations, false);
    let numeric = Kinematics::at(reduced, &point.position, &point.rates);
    let locks = reduced.equations.unilaterals.iter().filter_map(|unilateral| match &unilateral.value {
        UnilateralConstraint::Lock { engaged } if reads_blocks(engaged) => Some((&unilateral.element, engaged)),
        _ => None,
    });
    let engaged = |(element, formula): (&String, &Arc<Formula>)| {
        (value_with_blocks((&free, motion.clone()), formula, &numeric, output) > 0.5).then(|| element.clone())
    };
    locks.filter_map(engaged).collect()
}
