//! Constraints that a run keeps with their multipliers: angles and speeds stay on them.

use std::ops::Range;

use super::Machine;

/// Steps of Newton's method at most.
const MOST: usize = 12;
/// Units in the last place that are rounding.
const ROUNDED: f64 = 4.0;

/// Of its size at the ends of a step, what of the smallest pivot of the rows is taken for a loss of their rank.
const LOST: f64 = 1e-6;

impl Machine {
    /// Whether kept rows may become dependent along the motion.
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

    /// Looks at the kept rows at a state, for the steps to come.
    pub fn look_at_rows(&mut self, time: f64, state: &[f64]) {
        self.take_rows(time, state);
        (self.watched.sign, self.watched.least) = self.watched.eliminate(true);
    }

    /// Whether their determinant has another sign than where they were looked at.
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

    /// Whether they depend on each other at a state, beside what they are where they were looked at and at another state.
    pub fn rows_depend(&mut self, (time, state): (f64, &[f64]), (other, other_state): (f64, &[f64])) -> bool {
        let before = self.watched.least;
        self.look_at_rows(other, other_state);
        let usual = f64::max(before, self.watched.least);
        self.look_at_rows(time, state);
        self.watched.least < LOST * usual
    }

    /// Puts angles and speeds back on the kept rows, by the smallest changes in the metric of the inertia; tells whether any changed. Between
    /// two steps only what the tolerance left is taken away, so that nothing adds up.
    pub fn stay_on_rows(&mut self, time: f64, state: &mut [f64]) -> bool {
        if self.multiplier_constraints.is_empty() {
            return false;
        }
        let r = self.degrees_of_freedom;
        let moved = self.reach(time, state, (self.places.multiplier_positions.clone(), 0..r));
        let corrected = self.reach(time, state, (self.places.multiplier_speeds.clone(), r..2 * r));
        moved || corrected
    }

    /// `x −= H⁻¹Gᵀ (G H⁻¹Gᵀ)⁻¹ d` until nothing changes any more, d what is to vanish.
    fn reach(&mut self, time: f64, state: &mut [f64], (defects, part): (Range<usize>, Range<usize>)) -> bool {
        let (r, mut changed) = (self.degrees_of_freedom, false);
        for _ in 0..MOST {
            self.forces(time, state);
            self.factor_holding();
            // What holds besides stays where it is.
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
