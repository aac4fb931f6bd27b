//! A model at an instant: functions of time are numbers, sliding frictions are torques, sticking or engaged elements
//! are constraints.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use super::{Kinematics, Motion, Reduced, kinematics, reduce};
use crate::assemble::{DirectionalTerm, Equations, SpringLaw};
use crate::equations::{Formula, Meaning, UnilateralConstraint};
use kardan_math::num::{Rational, project, rational_from_f64, rational_to_f64};
use kardan_math::units::{Dimension, Exact};

/// The instant at which a model is evaluated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Instant {
    /// s
    pub time: f64,
    /// The block outputs then; blocks that are not named output zero.
    pub outputs: BTreeMap<String, f64>,
}

fn exact(value: f64) -> Exact {
    Exact::new(rational_from_f64(value).unwrap_or_default(), 0)
}

impl Instant {
    /// A formula in which no term depends on the time.
    fn formula(&self, formula: &Arc<Formula>) -> Arc<Formula> {
        let varies = |(_, meaning): &(String, Meaning)| {
            !matches!(meaning, Meaning::Constant(..) | Meaning::Position(_) | Meaning::Rate(_) | Meaning::Table(_))
        };
        if !formula.names.iter().any(varies) {
            return Arc::clone(formula);
        }
        let meaning = |meaning: &Meaning| match meaning {
            Meaning::Time => Meaning::Constant(exact(self.time), Dimension::TIME),
            Meaning::Signal(function) => Meaning::Constant(exact(function.value(self.time)), function.dimension()),
            Meaning::Block(name, dimension) => {
                Meaning::Constant(exact(self.outputs.get(name).copied().unwrap_or(0.0)), *dimension)
            }
            Meaning::Shared(shared) => Meaning::Shared(self.formula(shared)),
            other => other.clone(),
        };
        let names = formula.names.iter().map(|(name, own)| (name.clone(), meaning(own))).collect();
        Arc::new(Formula { names, ..Formula::clone(formula) })
    }

    /// The equations of motion then; prescribed offsets are constant.
    pub fn equations(&self, equations: &Equations) -> Equations {
        let mut out = equations.clone();
        let laws = out.laws.iter_mut().map(|law| &mut law.value);
        let unilaterals = out.unilaterals.iter_mut().filter_map(|unilateral| unilateral.value.formula_mut());
        laws.chain(unilaterals).for_each(|formula| *formula = self.formula(formula));
        for (element, function) in std::mem::take(&mut out.moving) {
            let own = out.constraints.iter_mut().filter(|row| row.element == element);
            own.for_each(|row| row.value = exact(function.value(self.time)));
        }
        out
    }
}

/// Numbers of the directions, among those of [`Equations::set_valued`], of locks that are engaged at a reduced position (rad) and at these speeds.
///
/// # Panics
/// If these have not one entry per coordinate.
pub fn engaged_locks(reduced: &Reduced, position: &[f64], speeds: &[f64]) -> BTreeSet<usize> {
    let first = reduced.equations.frictions.len();
    let locks =
        reduced.equations.unilaterals.iter().enumerate().filter_map(|(k, unilateral)| match &unilateral.value {
            UnilateralConstraint::Lock { engaged } => Some((first + k, engaged)),
            _ => None,
        });
    let engaged = |(_, formula): &(usize, &Arc<Formula>)| value_at(reduced, formula, position, speeds) > 0.5;
    locks.filter(engaged).map(|(direction, _)| direction).collect()
}

/// The value of a formula at a position and at speeds, at time zero.
fn value_at(reduced: &Reduced, formula: &Formula, position: &[f64], speeds: &[f64]) -> f64 {
    let (free, mut motion) = Motion::free(&reduced.equations, true);
    let value = motion.formula(&free, formula);
    let numeric = Kinematics::at(reduced, position, speeds);
    motion.values_at(&[value], &numeric.angles, &numeric.speeds)[0]
}

/// Speeds in all set-valued directions, rad/s.
///
/// # Panics
/// As [`engaged_locks`].
pub fn slip_speeds(reduced: &Reduced, position: &[f64], speeds: &[f64]) -> Vec<f64> {
    let numeric = Kinematics::at(reduced, position, speeds);
    let row_speed = |row: &[(usize, Rational)]| {
        // A speed at the level of rounding does not slip.
        let parts = row.iter().map(|(k, a)| rational_to_f64(a) * numeric.speeds[*k]);
        let (sum, size) = parts.fold((0.0, 0.0), |(sum, size), part: f64| (sum + part, f64::max(size, part.abs())));
        if sum.abs() <= SLIPS * size { 0.0 } else { sum }
    };
    reduced.equations.set_valued().map(|(_, row)| row_speed(row)).collect()
}

/// Part of the speeds that a slip is the difference of, below which it is none.
const SLIPS: f64 = 1e-9;

/// With the torques of sliding frictions: for each set-valued direction the sign of its speed, zero where it does not
/// slide. Gear losses, whose torque depends on the load, are left out.
pub fn with_sliding(equations: &Equations, signs: &[f64]) -> Equations {
    let mut out = equations.clone();
    let first = equations.frictions.len();
    for (k, sign) in signs.iter().enumerate().filter(|(_, sign)| **sign != 0.0) {
        let against = |text: &str| if *sign > 0.0 { format!("-({text})") } else { text.to_string() };
        let (element, row, formula) = match k.checked_sub(first) {
            None => {
                let friction = &equations.frictions[k];
                (&friction.element, &friction.row, coulomb(equations, k, &against))
            }
            Some(unilateral) => {
                let unilateral = &equations.unilaterals[unilateral];
                let UnilateralConstraint::Friction { torque, .. } = &unilateral.value else { continue };
                let names = vec![("torque".to_string(), Meaning::Shared(Arc::clone(torque)))];
                (&unilateral.element, &unilateral.row, Formula::of(&against("@"), names, torque.dimension))
            }
        };
        out.laws.push(DirectionalTerm { element: element.clone(), row: row.clone(), value: formula });
    }
    out
}

/// `c + (c_b − c) exp(−(v/v_s)²)`, with v the speed in the direction of a friction.
fn coulomb(equations: &Equations, friction: usize, against: &dyn Fn(&str) -> String) -> Arc<Formula> {
    let friction = &equations.frictions[friction];
    let domain = equations.domain_of(friction);
    let effort = domain.effort_dimension();
    let mut names = vec![("c".to_string(), Meaning::Constant(friction.value.torque.clone(), effort))];
    let Some(stribeck) = &friction.value.stribeck else { return Formula::of(&against("@"), names, effort) };
    let [_, speed] = domain.dimensions();
    let c = names[0].clone();
    names.extend([("breakaway".to_string(), Meaning::Constant(stribeck.breakaway.clone(), effort)), c]);
    let mut squares = Vec::new();
    for (number, (k, a)) in friction.row.iter().enumerate() {
        let [_, own] = equations.domain(*k).dimensions();
        let share = Meaning::Constant(Exact::new(a.clone(), 0), speed.times(&own, -1).unwrap_or(Dimension::NONE));
        names.push((format!("share_{number}"), share));
        names.push((format!("rate_{number}"), Meaning::Rate(equations.coordinates[*k].clone())));
        squares.push("@ * @");
    }
    names.push(("scale".to_string(), Meaning::Constant(stribeck.speed.clone(), speed)));
    Formula::of(&against(&format!("@ + (@ - @) * exp(-(({}) / @)^2)", squares.join(" + "))), names, effort)
}

/// The model in which these set-valued directions stick, at a reduced position (rad): constraints replace them.
/// Coordinates in `named` stay coordinates, where others may follow instead. A constraint that is redundant, or that no
/// order of evaluation allows, is left out.
///
/// # Panics
/// If the position has not one entry per coordinate.
pub fn with_enforced(reduced: &Reduced, enforced: &BTreeSet<usize>, position: &[f64], named: &[String]) -> Reduced {
    let numeric = Kinematics::at_rest(reduced, position);
    let rows: Vec<(String, Vec<(usize, Rational)>)> = reduced
        .equations
        .set_valued()
        .enumerate()
        .filter(|(k, _)| enforced.contains(k))
        .map(|(_, (element, row))| (element.to_string(), row.to_vec()))
        .collect();
    let mut equations = reduced.equations.clone();
    let mut number = 0;
    let mut stays = || {
        number += 1;
        !enforced.contains(&(number - 1))
    };
    equations.frictions.retain(|_| stays());
    equations.unilaterals.retain(|_| stays());
    let mut out = Reduced { equations, ..reduced.clone() };
    for (element, row) in rows {
        let at: Vec<f64> = out.coordinates.iter().map(|shaft| numeric.angles[*shaft]).collect();
        let reduced_row = project(&row, &kinematics::exact_basis(&out, &at));
        let names = out.coordinate_names();
        let mut places: Vec<usize> = reduced_row.iter().map(|(k, _)| *k).rev().collect();
        places.sort_by_key(|k| named.contains(&names[*k]));
        let offset = row.iter().map(|(k, a)| rational_to_f64(a) * numeric.angles[*k]).sum();
        let mut equations = out.equations.clone();
        equations.add_constraint(DirectionalTerm { element, row, value: exact(offset) });
        let eliminate = |k: usize| {
            let free_names: Vec<String> =
                names.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, n)| n.clone()).collect();
            reduce(equations.clone(), Some(&free_names)).ok()
        };
        out = places.into_iter().find_map(eliminate).unwrap_or(out);
    }
    out
}

/// The model in which these contacts (numbers of unilateral constraints) are closed at a reduced position (rad):
/// springs and dampers replace soft ones, relaxed at first contact, and constraints replace rigid ones.
///
/// # Panics
/// If the position has not one entry per coordinate.
pub fn closed_contacts(reduced: &Reduced, closed: &BTreeSet<usize>, position: &[f64]) -> Reduced {
    let mut out = reduced.clone();
    let (mut number, mut soft) = (0, BTreeSet::new());
    let equations = &mut out.equations;
    for k in closed {
        let unilateral = &reduced.equations.unilaterals[*k];
        let UnilateralConstraint::Cushion { offset, stiffness, damping, .. } = &unilateral.value else { continue };
        let spring = SpringLaw { stiffness: stiffness.clone(), rest: offset.clone() };
        equations.add_spring(&unilateral.element, unilateral.row.clone(), spring, damping);
        soft.insert(*k);
    }
    equations.unilaterals.retain(|_| {
        number += 1;
        !soft.contains(&(number - 1))
    });
    let first = equations.frictions.len();
    let now = |k: &usize| first + k - soft.iter().filter(|candidate| *candidate < k).count();
    let rigid: BTreeSet<usize> = closed.difference(&soft).map(now).collect();
    if rigid.is_empty() { out } else { with_enforced(&out, &rigid, position, &[]) }
}
