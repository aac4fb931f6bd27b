//! Constraint torques as expressions of motion, accelerations and torques.

use std::collections::BTreeMap;

use super::{Motion, Reduced};
use crate::assemble::{DirectionalTerm, SpringLaw};
use crate::equations::UnilateralConstraint;
use kardan_expr::expr::{Expr, Graph};
use kardan_math::num::Rational;
use kardan_math::units::Exact;

/// The torques on the shafts besides springs, dampers and inertias, and their accelerations.
#[derive(Debug, Clone, Copy)]
pub struct Acting<'a> {
    /// q̈_r
    pub accelerations: &'a [Expr],
    /// Torques of the inputs.
    pub inputs: &'a [Expr],
    /// Torques of the frictions, against the sense of their directions.
    pub frictions: &'a [Expr],
}

/// A linear system of equations whose entries are expressions.
struct System<'a> {
    graph: &'a mut Graph,
    /// Of each equation its unknowns with their coefficients, and its right side.
    equations: Vec<(BTreeMap<usize, Expr>, Expr)>,
}

impl Motion {
    /// `K q̈_r + k`, one for each shaft.
    pub fn shaft_accelerations(&mut self, accelerations: &[Expr]) -> Vec<Expr> {
        let shaft = |out: &mut Self, shaft: usize| {
            let mut terms = vec![(out.bias[shaft], Rational::ONE)];
            for (k, entry) in out.basis[shaft].clone() {
                terms.push((out.graph.multiply(entry, accelerations[k]), Rational::ONE));
            }
            let sum = out.graph.sum(Rational::ZERO, &terms);
            out.graph.group(sum)
        };
        (0..self.basis.len()).map(|k| shaft(self, k)).collect()
    }

    /// The torque of a spring, N m: `s (aᵀq − rest)`.
    pub fn spring_torque(&mut self, reduced: &Reduced, spring: usize) -> Expr {
        let spring = &reduced.equations.springs[spring];
        let twist = self.twist(reduced, spring);
        let torque = self.resisting(twist, &spring.value.stiffness);
        self.scaled_by_fault(reduced, &spring.element, torque)
    }

    fn twist(&mut self, reduced: &Reduced, spring: &DirectionalTerm<SpringLaw>) -> Expr {
        let (angle, rest) = (self.sum(&spring.row, |out, k| out.angles[k]), self.exact(&spring.value.rest));
        let twist = self.graph.subtract(angle, rest);
        let moved = reduced.equations.failing.get(&spring.element).and_then(|failing| failing.moved.clone());
        match moved {
            None => twist,
            Some(moved) => {
                let moved = self.of_time(&moved);
                self.graph.subtract(twist, moved)
            }
        }
    }

    /// The remaining fraction of an element's torque, where it breaks during a run: a product, so that zero is zero.
    pub fn scaled_by_fault(&mut self, reduced: &Reduced, element: &str, expr: Expr) -> Expr {
        let Some(share) = reduced.equations.failing.get(element).and_then(|failing| failing.share.clone()) else {
            return expr;
        };
        let more = self.of_time(&share);
        let remaining_share = self.graph.sum(Rational::ONE, &[(more, Rational::ONE)]);
        let (remaining_share, expr) = (self.graph.group(remaining_share), self.graph.group(expr));
        let product = self.graph.multiply(remaining_share, expr);
        self.graph.group(product)
    }

    /// The torque of a damper, N m: `d aᵀq̇`.
    pub fn damper_torque(&mut self, reduced: &Reduced, damper: usize) -> Expr {
        let DirectionalTerm { element, row, value } = &reduced.equations.dampers[damper];
        let speed = self.sum(row, |out, k| out.speeds[k]);
        let torque = self.resisting(speed, value);
        self.scaled_by_fault(reduced, element, torque)
    }

    /// A coefficient times a rate that is one number: the twist is computed before the product, so that the rounding
    /// error is that of the twist.
    pub(super) fn resisting(&mut self, rate: Expr, coefficient: &Exact) -> Expr {
        let (rate, coefficient) = (self.graph.group(rate), self.exact(coefficient));
        self.graph.multiply(coefficient, rate)
    }

    /// Kinetic and potential energy, J.
    pub fn energy(&mut self, reduced: &Reduced) -> Expr {
        let half = Rational::from_parts(1.into(), 2u8.into());
        let mut terms = Vec::new();
        let mut add = |out: &mut Self, rate: Expr, coefficient: &Exact, spring: Option<&str>| {
            let (rate, coefficient) = (out.graph.group(rate), out.exact(coefficient));
            let energy = out.graph.product(&[(coefficient, 1), (rate, 2)]);
            let energy = spring.map_or(energy, |spring| out.scaled_by_fault(reduced, spring, energy));
            terms.push((energy, half.clone()));
        };
        for DirectionalTerm { row, value, .. } in &reduced.equations.inertias {
            let speed = self.sum(row, |out, k| out.speeds[k]);
            add(self, speed, value, None);
        }
        for spring in &reduced.equations.springs {
            let twist = self.twist(reduced, spring);
            add(self, twist, &spring.value.stiffness, Some(&spring.element));
        }
        for unilateral in &reduced.equations.unilaterals {
            let UnilateralConstraint::Cushion { offset, stiffness, .. } = &unilateral.value else { continue };
            let (angle, offset) = (self.sum(&unilateral.row, |out, k| out.angles[k]), self.exact(offset));
            let zero = self.graph.integer(0);
            let beyond = self.graph.subtract(offset, angle);
            let beyond = self.graph.max(beyond, zero);
            add(self, beyond, stiffness, None);
        }
        self.graph.sum(Rational::ZERO, &terms)
    }

    /// The multipliers of all constraints, in the order of [`Reduced::constraint_elements`]: `Jᵀλ = H q̈ + D q̇ + S q + friction − laws − F τ`
    /// \[diss. (4.18), (4.36)\], where the equations of the shafts that follow suffice.
    pub fn multipliers(&mut self, reduced: &Reduced, acting: Acting<'_>) -> Vec<Expr> {
        let equations = &reduced.equations;
        let count = equations.constraints.len() + equations.transmissions.len();
        let forces = self.shaft_forces(reduced, acting);
        let mut columns: Vec<BTreeMap<usize, Expr>> = vec![BTreeMap::new(); equations.coordinates.len()];
        for k in 0..count {
            for (shaft, coefficient) in self.constraint_row(reduced, k) {
                columns[shaft].insert(k, coefficient);
            }
        }
        let dependents = reduced.dependents();
        let equations = dependents.iter().map(|&shaft| (std::mem::take(&mut columns[shaft]), forces[shaft])).collect();
        let minimal = System { graph: &mut self.graph, equations }.solve(count);
        if reduced.redundant.is_empty() {
            return minimal;
        }
        let share = |graph: &mut Graph, shares: Vec<(usize, Rational)>| {
            let terms: Vec<(Expr, Rational)> = shares.into_iter().map(|(row, share)| (minimal[row], share)).collect();
            graph.sum(Rational::ZERO, &terms)
        };
        reduced.split(count).into_iter().map(|shares| share(&mut self.graph, shares)).collect()
    }

    /// The coefficients of a constraint over the shafts; of a transmission 1 and −γ′.
    pub fn constraint_row(&mut self, reduced: &Reduced, constraint: usize) -> Vec<(usize, Expr)> {
        let equations = &reduced.equations;
        if let Some(linear) = reduced.linear_constraint(constraint) {
            let number = |(shaft, c): &(usize, Rational)| (*shaft, self.graph.number(c.clone()));
            return linear.row.iter().map(number).collect();
        }
        let transmission = &equations.transmissions[constraint - equations.constraints.len()];
        let [_, slope, _] = transmission.curve.expressions(&mut self.graph, self.angles[transmission.driving]);
        let (one, slope) = (self.graph.integer(1), self.graph.negate(slope));
        vec![(transmission.driven, one), (transmission.driving, slope)]
    }

    /// The torques on the shafts that constraints must supply.
    fn shaft_forces(&mut self, reduced: &Reduced, acting: Acting<'_>) -> Vec<Expr> {
        let equations = &reduced.equations;
        let mut forces: Vec<Vec<(Expr, Rational)>> = vec![Vec::new(); equations.coordinates.len()];
        let mut add = |row: &[(usize, Rational)], torque: Expr, sign: i8| {
            row.iter().for_each(|(shaft, c)| forces[*shaft].push((torque, c * Rational::from(sign))));
        };
        let accelerations = self.shaft_accelerations(acting.accelerations);
        for DirectionalTerm { row, value, .. } in &equations.inertias {
            let acceleration = self.sum(row, |_, k| accelerations[k]);
            add(row, self.resisting(acceleration, value), 1);
        }
        for (k, damper) in equations.dampers.iter().enumerate() {
            add(&damper.row, self.damper_torque(reduced, k), 1);
        }
        for (k, spring) in equations.springs.iter().enumerate() {
            add(&spring.row, self.spring_torque(reduced, k), 1);
        }
        for (law, torque) in equations.laws.iter().zip(self.laws.clone()) {
            add(&law.row, torque, -1);
        }
        equations.set_valued().zip(acting.frictions).for_each(|((_, row), torque)| add(row, *torque, 1));
        equations.inputs.iter().zip(acting.inputs).for_each(|(term, torque)| add(&term.row, *torque, -1));
        for (k, torque) in acting.frictions.iter().skip(equations.set_valued().count()).enumerate() {
            for (shaft, entry) in self.multiplier_constraints[k].row.clone() {
                forces[shaft].push((self.graph.multiply(entry, *torque), Rational::ONE));
            }
        }
        let graph = &mut self.graph;
        let mut total = |terms: &Vec<(Expr, Rational)>| {
            let sum = graph.sum(Rational::ZERO, terms);
            graph.group(sum)
        };
        forces.iter().map(&mut total).collect()
    }
}

impl System<'_> {
    /// Elimination order of the unknowns: a nonzero number before other expressions, then the unknown with the fewest
    /// neighbours.
    fn solve(mut self, count: usize) -> Vec<Expr> {
        let mut solved: Vec<(usize, BTreeMap<usize, Expr>, Expr)> = Vec::with_capacity(count);
        while let Some((row, column)) = self.pivot() {
            let (mut own, right) = self.equations.swap_remove(row);
            let pivot = own.remove(&column).expect("the pivot is an entry");
            for (entries, other) in &mut self.equations {
                let Some(entry) = entries.remove(&column) else { continue };
                let factor = self.graph.divide(entry, pivot);
                for (k, x) in &own {
                    let before = entries.remove(k).unwrap_or_else(|| self.graph.integer(0));
                    let change = self.graph.multiply(factor, *x);
                    let after = self.graph.subtract(before, change);
                    if !self.graph.is_zero(after) {
                        entries.insert(*k, after);
                    }
                }
                let change = self.graph.multiply(factor, right);
                let sum = self.graph.subtract(*other, change);
                *other = self.graph.group(sum);
            }
            let one = self.graph.divide(right, pivot);
            let shares = own.into_iter().map(|(k, x)| (k, self.graph.divide(x, pivot))).collect();
            solved.push((column, shares, one));
        }
        let mut unknowns = vec![self.graph.integer(0); count];
        for (column, shares, one) in solved.into_iter().rev() {
            let mut terms = vec![(one, Rational::ONE)];
            for (k, share) in shares {
                terms.push((self.graph.multiply(share, unknowns[k]), Rational::from(-1)));
            }
            let sum = self.graph.sum(Rational::ZERO, &terms);
            unknowns[column] = self.graph.group(sum);
        }
        unknowns
    }

    /// Equation and unknown of the next pivot.
    fn pivot(&self) -> Option<(usize, usize)> {
        let mut uses: BTreeMap<usize, usize> = BTreeMap::new();
        self.equations.iter().flat_map(|(entries, _)| entries.keys()).for_each(|k| *uses.entry(*k).or_default() += 1);
        let entries = self.equations.iter().enumerate();
        let all =
            entries.flat_map(|(row, (entries, _))| entries.iter().map(move |(k, x)| (row, *k, *x, entries.len())));
        let cost = |(_, k, x, length): &(usize, usize, Expr, usize)| {
            (self.graph.number_of(*x).is_none(), (length - 1) * (uses[k] - 1))
        };
        all.min_by_key(cost).map(|(row, k, ..)| (row, k))
    }
}
