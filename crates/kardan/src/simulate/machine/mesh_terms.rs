//! What teeth that rub carry, in the expressions of the loop.

use crate::assemble::Along;
use crate::equations::{Hold, Mesh};
use crate::expr::Expr;
use crate::num::{Rational, Scalar};
use crate::reduce::{Acting, Motion, Reduced};
use crate::units::Dimension;

/// What teeth carry, in the expressions of the loop: for each mesh the torque without accelerations and without what holds; for one of each
/// acceleration; for one of each torque of frictions, holds and kept rows.
pub(super) struct MeshTerms {
    pub now: Vec<Expr>,
    pub by_acceleration: Vec<Expr>,
    pub by_torque: Vec<Expr>,
}

/// The meshes of a model among what holds.
pub(super) fn meshes(reduced: &Reduced) -> impl Iterator<Item = (usize, &Along<Hold>, &Mesh)> {
    let first = reduced.equations.frictions.len();
    let all = reduced.equations.holds.iter().enumerate();
    all.filter_map(
        move |(k, hold)| if let Hold::Mesh(mesh) = &hold.value { Some((first + k, hold, mesh)) } else { None },
    )
}

impl MeshTerms {
    pub fn new(motion: &mut Motion, reduced: &Reduced, applied: &[Expr], friction: &[Expr]) -> Self {
        let mut out = Self { now: Vec::new(), by_acceleration: Vec::new(), by_torque: Vec::new() };
        if meshes(reduced).next().is_none() {
            return out;
        }
        // What losses name of the time is given to the loop.
        let zero = motion.graph.integer(0);
        for loss in meshes(reduced).filter_map(|(.., mesh)| mesh.loss.as_ref()) {
            motion.formula_of(reduced, loss, [zero; 2]);
        }
        let (r, holding) = (reduced.degrees_of_freedom(), friction.len() + reduced.equations.kept.len());
        let zeros = vec![motion.graph.integer(0); r];
        let acting = Acting { accelerations: &zeros, inputs: applied, frictions: friction };
        let now = motion.multipliers(reduced, acting);
        let mut symbols = |name: &str, count: usize| -> Vec<Expr> {
            (0..count).map(|k| motion.graph.new_symbol(format!("{name}.{k}"), Dimension::NONE)).collect()
        };
        let (accelerations, torques) = (symbols("unit_acceleration", r), symbols("unit_torque", holding));
        let acting = Acting { accelerations: &accelerations, inputs: applied, frictions: &torques };
        let moved = motion.multipliers(reduced, acting);
        for (_, hold, _) in meshes(reduced) {
            let Some(constraint) = constraint_of(reduced, hold) else {
                // A spring in place of the constraint carries what its twist says, the sides of a play what they press with.
                let [carried, pressed] = [sprung(motion, reduced, hold), pressed(motion, reduced, (hold, friction))];
                out.now.push(motion.graph.add(carried, pressed));
                out.by_acceleration.extend(&zeros);
                out.by_torque.extend(held(motion, reduced, hold, holding));
                continue;
            };
            let coefficient = first_entry(motion, reduced, constraint, hold);
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
fn first_body(hold: &Along<Hold>) -> Option<usize> {
    hold.row.iter().find(|(_, x)| *x > Rational::ZERO).map(|(body, _)| *body)
}

/// The torque of the springs and dampers of the element on the first body: `−a (s (aᵀq − rest) + d aᵀq̇)`.
fn sprung(motion: &mut Motion, reduced: &Reduced, hold: &Along<Hold>) -> Expr {
    let equations = &reduced.equations;
    let share = |row: &[(usize, Rational)]| {
        let own = row.iter().find(|(body, _)| Some(*body) == first_body(hold));
        own.map_or(Rational::ZERO, |(_, x)| Rational::ZERO.minus(x))
    };
    let mut terms = Vec::new();
    for (k, spring) in equations.springs.iter().enumerate().filter(|(_, spring)| spring.element == hold.element) {
        terms.push((motion.spring_torque(reduced, k), share(&spring.row)));
    }
    for (k, damper) in equations.dampers.iter().enumerate().filter(|(_, damper)| damper.element == hold.element) {
        terms.push((motion.damper_torque(reduced, k), share(&damper.row)));
    }
    let sum = motion.graph.sum(Rational::ZERO, &terms);
    motion.graph.group(sum)
}

/// The sides of the play of the element: numbers of their directions, and what one of their torques, which oppose motion, puts on the first body.
fn sides<'a>(reduced: &'a Reduced, hold: &'a Along<Hold>) -> impl Iterator<Item = (usize, Rational, &'a Hold)> {
    let first = reduced.equations.frictions.len();
    let own = reduced.equations.holds.iter().enumerate().filter(|(_, other)| other.element == hold.element);
    own.filter(|(_, other)| matches!(other.value, Hold::Stop { .. } | Hold::Cushion { .. })).map(move |(k, other)| {
        let entry = other.row.iter().find(|(body, _)| Some(*body) == first_body(hold));
        (first + k, entry.map_or(Rational::ZERO, |(_, x)| Rational::ZERO.minus(x)), &other.value)
    })
}

/// The torque of soft sides on the first body.
fn pressed(motion: &mut Motion, reduced: &Reduced, (hold, friction): (&Along<Hold>, &[Expr])) -> Expr {
    let soft = sides(reduced, hold).filter(|(.., side)| matches!(side, Hold::Cushion { .. }));
    let terms: Vec<(Expr, Rational)> = soft.map(|(k, share, _)| (friction[k], share)).collect();
    let sum = motion.graph.sum(Rational::ZERO, &terms);
    motion.graph.group(sum)
}

/// That of rigid sides for one of each torque that holds.
fn held(motion: &mut Motion, reduced: &Reduced, hold: &Along<Hold>, count: usize) -> Vec<Expr> {
    let mut out = vec![motion.graph.integer(0); count];
    for (k, share, _) in sides(reduced, hold).filter(|(.., side)| matches!(side, Hold::Stop { .. })) {
        out[k] = motion.graph.number(share);
    }
    out
}

/// The constraint whose teeth rub; none where a spring stands in its place.
fn constraint_of(reduced: &Reduced, hold: &Along<Hold>) -> Option<usize> {
    let equations = &reduced.equations;
    let linear = equations.constraints.iter().map(|row| &row.element);
    let mut all = linear.chain(equations.transmissions.iter().map(|curve| &curve.element));
    all.position(|element| *element == hold.element)
}

/// The coefficient that the constraint has for the first body of the direction.
fn first_entry(motion: &mut Motion, reduced: &Reduced, constraint: usize, hold: &Along<Hold>) -> Expr {
    let body = first_body(hold);
    let row = motion.constraint_row(reduced, constraint);
    let entry = row.into_iter().find(|(other, _)| Some(*other) == body).map(|(_, entry)| entry);
    entry.unwrap_or_else(|| motion.graph.integer(0))
}
