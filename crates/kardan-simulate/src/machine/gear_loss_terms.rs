//! Gear loads in the expressions of the loop.

use crate::compiled_plan::symbols;
use kardan_expr::expr::Expr;
use kardan_math::num::{Rational, Scalar};
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::{GearLoss, UnilateralConstraint};
use kardan_mechanics::reduce::{Acting, Motion, Reduced};

/// Gear loads, in the expressions of the loop: for each gear the torque without accelerations and without active
/// constraints; the coefficient for each acceleration; the coefficient for each torque of frictions, unilateral
/// constraints and multiplier constraints.
pub(super) struct GearLossTerms {
    pub now: Vec<Expr>,
    pub by_acceleration: Vec<Expr>,
    pub by_torque: Vec<Expr>,
}

/// The gear losses of a model among its unilateral constraints.
pub(super) fn gear_losses(
    reduced: &Reduced,
) -> impl Iterator<Item = (usize, &DirectionalTerm<UnilateralConstraint>, &GearLoss)> {
    let first = reduced.equations.frictions.len();
    let all = reduced.equations.unilaterals.iter().enumerate();
    all.filter_map(move |(k, unilateral)| {
        if let UnilateralConstraint::GearLoss(gear) = &unilateral.value {
            Some((first + k, unilateral, gear))
        } else {
            None
        }
    })
}

impl GearLossTerms {
    pub fn new(motion: &mut Motion, reduced: &Reduced, applied: &[Expr], friction: &[Expr]) -> Self {
        let mut out = Self { now: Vec::new(), by_acceleration: Vec::new(), by_torque: Vec::new() };
        if gear_losses(reduced).next().is_none() {
            return out;
        }
        // Time-dependent symbols of losses are inputs of the loop.
        let zero = motion.graph.integer(0);
        for loss in gear_losses(reduced).filter_map(|(.., gear)| gear.loss.as_ref()) {
            motion.formula_with(reduced, loss, [zero; 2], &[]);
        }
        let (r, holding) =
            (reduced.degrees_of_freedom(), friction.len() + reduced.equations.multiplier_constraints.len());
        let zeros = vec![motion.graph.integer(0); r];
        let acting = Acting { accelerations: &zeros, inputs: applied, frictions: friction };
        let now = motion.multipliers(reduced, acting);
        let accelerations = symbols(&mut motion.graph, "unit_acceleration", r);
        let torques = symbols(&mut motion.graph, "unit_torque", holding);
        let acting = Acting { accelerations: &accelerations, inputs: applied, frictions: &torques };
        let moved = motion.multipliers(reduced, acting);
        for (_, unilateral, _) in gear_losses(reduced) {
            let Some(constraint) = constraint_of(reduced, unilateral) else {
                // A spring that replaces the constraint carries the torque of its twist, the sides of a backlash their
                // contact torque.
                let [carried, pressed] =
                    [sprung(motion, reduced, unilateral), pressed(motion, reduced, (unilateral, friction))];
                out.now.push(motion.graph.add(carried, pressed));
                out.by_acceleration.extend(&zeros);
                out.by_torque.extend(rigid_torques(motion, reduced, unilateral, holding));
                continue;
            };
            let coefficient = first_entry(motion, reduced, constraint, unilateral);
            let scaled = |motion: &mut Motion, multiplier: Expr| motion.graph.multiply(coefficient, multiplier);
            out.now.push(scaled(motion, now[constraint]));
            for (list, symbols) in [(&mut out.by_acceleration, &accelerations), (&mut out.by_torque, &torques)] {
                for symbol in symbols {
                    let symbol = motion.graph.symbol_of(*symbol).expect("it was made as one");
                    let slope = motion.graph.derivatives(&[moved[constraint]], symbol)[0];
                    list.push(scaled(motion, slope));
                }
            }
        }
        out
    }
}

/// The first body of the direction.
fn first_body(unilateral: &DirectionalTerm<UnilateralConstraint>) -> Option<usize> {
    unilateral.row.iter().find(|(_, x)| *x > Rational::ZERO).map(|(body, _)| *body)
}

/// The torque of the springs and dampers of the element on the first body: `−a (s (aᵀq − rest) + d aᵀq̇)`.
fn sprung(motion: &mut Motion, reduced: &Reduced, unilateral: &DirectionalTerm<UnilateralConstraint>) -> Expr {
    let equations = &reduced.equations;
    let share = |row: &[(usize, Rational)]| {
        let own = row.iter().find(|(body, _)| Some(*body) == first_body(unilateral));
        own.map_or(Rational::ZERO, |(_, x)| Rational::ZERO.minus(x))
    };
    let mut terms = Vec::new();
    for (k, spring) in equations.springs.iter().enumerate().filter(|(_, spring)| spring.element == unilateral.element) {
        terms.push((motion.spring_torque(reduced, k), share(&spring.row)));
    }
    for (k, damper) in equations.dampers.iter().enumerate().filter(|(_, damper)| damper.element == unilateral.element) {
        terms.push((motion.damper_torque(reduced, k), share(&damper.row)));
    }
    let sum = motion.graph.sum(Rational::ZERO, &terms);
    motion.graph.group(sum)
}

/// The backlash sides of the element: numbers of their directions, and the torque on the first body per unit of theirs,
/// which oppose motion.
fn sides<'a>(
    reduced: &'a Reduced,
    unilateral: &'a DirectionalTerm<UnilateralConstraint>,
) -> impl Iterator<Item = (usize, Rational, &'a UnilateralConstraint)> {
    let first = reduced.equations.frictions.len();
    let own = reduced.equations.unilaterals.iter().enumerate().filter(|(_, stop)| stop.element == unilateral.element);
    own.filter(|(_, stop)| {
        matches!(stop.value, UnilateralConstraint::Stop { .. } | UnilateralConstraint::Cushion { .. })
    })
    .map(move |(k, stop)| {
        let entry = stop.row.iter().find(|(body, _)| Some(*body) == first_body(unilateral));
        (first + k, entry.map_or(Rational::ZERO, |(_, x)| Rational::ZERO.minus(x)), &stop.value)
    })
}

/// The torque of soft sides on the first body.
fn pressed(
    motion: &mut Motion,
    reduced: &Reduced,
    (unilateral, friction): (&DirectionalTerm<UnilateralConstraint>, &[Expr]),
) -> Expr {
    let soft = sides(reduced, unilateral).filter(|(.., side)| matches!(side, UnilateralConstraint::Cushion { .. }));
    let terms: Vec<(Expr, Rational)> = soft.map(|(k, share, _)| (friction[k], share)).collect();
    let sum = motion.graph.sum(Rational::ZERO, &terms);
    motion.graph.group(sum)
}

/// The torque of rigid sides for each unit of constraint torque.
fn rigid_torques(
    motion: &mut Motion,
    reduced: &Reduced,
    unilateral: &DirectionalTerm<UnilateralConstraint>,
    count: usize,
) -> Vec<Expr> {
    let mut out = vec![motion.graph.integer(0); count];
    for (k, share, _) in
        sides(reduced, unilateral).filter(|(.., side)| matches!(side, UnilateralConstraint::Stop { .. }))
    {
        out[k] = motion.graph.number(share);
    }
    out
}

/// The constraint with the gear loss; none where a spring replaces it.
fn constraint_of(reduced: &Reduced, unilateral: &DirectionalTerm<UnilateralConstraint>) -> Option<usize> {
    let equations = &reduced.equations;
    let linear = equations.constraints.iter().map(|row| &row.element);
    let mut all = linear.chain(equations.transmissions.iter().map(|curve| &curve.element));
    all.position(|element| *element == unilateral.element)
}

/// The coefficient that the constraint has for the first body of the direction.
fn first_entry(
    motion: &mut Motion,
    reduced: &Reduced,
    constraint: usize,
    unilateral: &DirectionalTerm<UnilateralConstraint>,
) -> Expr {
    let body = first_body(unilateral);
    let row = motion.constraint_row(reduced, constraint);
    let entry = row.into_iter().find(|(candidate, _)| Some(*candidate) == body).map(|(_, entry)| entry);
    entry.unwrap_or_else(|| motion.graph.integer(0))
}
