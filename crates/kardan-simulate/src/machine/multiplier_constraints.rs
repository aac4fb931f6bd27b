//! Constraints that a run enforces with multipliers: angles and speeds satisfy them.

use std::ops::Range;

use super::Machine;

/// Most steps of Newton's method.
const MOST: usize = 12;
/// Units in the last place that count as rounding.
const ROUNDED: f64 = 4.0;

/// Relative to its size at the ends of a step, the smallest pivot of the rows that counts as a loss of rank.
const LOST: f64 = 1e-6;

impl Machine {
    /// Whether multiplier constraints may become dependent during the motion.
    pub fn watches_rows(&self) -> bool {
        !self.multiplier_constraints.is_empty() && !self.active_constant
    }

    fn take_rows(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        self.forces(time, state);
        self.watched.matrix.copy_from_slice(
            &self.work.friction_rows[self.multiplier_constraints.start * r..self.multiplier_constraints.end * r],
        );
    }

    /// Evaluates the multiplier constraints at a state, as the reference for the next steps.
    pub fn inspect_rows(&mut self, time: f64, state: &[f64]) {
        self.take_rows(time, state);
        (self.watched.sign, self.watched.least) = self.watched.eliminate(true);
    }

    /// Whether the sign of their determinant differs from that at the reference.
    pub fn rows_changed_sign(&mut self, time: f64, state: &[f64]) -> bool {
        self.take_rows(time, state);
        let (sign, _) = self.watched.eliminate(false);
        self.watched.sign * sign < 0.0 || sign == 0.0 && self.watched.sign != 0.0
    }

    /// Their smallest pivot at a state.
    pub fn least_pivot(&mut self, time: f64, state: &[f64]) -> f64 {
        self.take_rows(time, state);
        self.watched.eliminate(true).1
    }

    /// Whether they depend on each other at a state, relative to their values at the reference and at another state.
    pub fn rows_depend(&mut self, (time, state): (f64, &[f64]), (other, other_state): (f64, &[f64])) -> bool {
        let before = self.watched.least;
        self.inspect_rows(other, other_state);
        let usual = f64::max(before, self.watched.least);
        self.inspect_rows(time, state);
        self.watched.least < LOST * usual
    }

    /// Projects angles and speeds onto the multiplier constraints, by the smallest changes in the metric of the
    /// inertia; returns whether any changed. Between two steps this removes only the error that the tolerance allowed,
    /// so it does not accumulate.
    pub fn stay_on_rows(&mut self, time: f64, state: &mut [f64]) -> bool {
        if self.multiplier_constraints.is_empty() {
            return false;
        }
        let r = self.degrees_of_freedom;
        let moved = self.reach(time, state, (self.places.multiplier_positions.clone(), 0..r));
        let corrected = self.reach(time, state, (self.places.multiplier_speeds.clone(), r..2 * r));
        moved || corrected
    }

    /// `x −= H⁻¹Gᵀ (G H⁻¹Gᵀ)⁻¹ d` until x does not change any more, with the residual d.
    fn reach(&mut self, time: f64, state: &mut [f64], (defects, part): (Range<usize>, Range<usize>)) -> bool {
        let (r, mut changed) = (self.degrees_of_freedom, false);
        for _ in 0..MOST {
            self.forces(time, state);
            self.factor_holding();
            // Other active directions keep their values.
            let of = |row: usize| self.work.more(&self.dynamics, defects.start + row);
            let gaps = self.holding.iter().map(|k| k.checked_sub(self.multiplier_constraints.start).map_or(0.0, of));
            let mut defect: Vec<f64> = gaps.collect();
            if defect.iter().all(|x| *x == 0.0) {
                break;
            }
            self.active_factor.solve(&mut defect);
            let mut largest = 0.0f64;
            let mut changes = vec![0.0; r];
            for (weighted, factor) in self.weighted.chunks_exact(r.max(1)).zip(&defect) {
                changes.iter_mut().zip(weighted).for_each(|(change, weight)| *change += weight * factor);
            }
            self.still.iter().for_each(|&i| changes[i] = 0.0);
            for (x, change) in state[part.clone()].iter().zip(&changes) {
                largest = largest.max(change.abs() / (ROUNDED * f64::EPSILON * x.abs().max(1.0)));
            }
            if largest <= 1.0 || !changes.iter().all(|change| change.is_finite()) {
                break;
            }
            state[part.clone()].iter_mut().zip(&changes).for_each(|(x, change)| *x -= change);
            changed = true;
        }
        changed
    }
}
