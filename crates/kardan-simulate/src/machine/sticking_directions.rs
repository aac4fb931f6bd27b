//! The sticking directions: independent ones among them, those that follow from these, and coordinates that are at rest because of them.

use super::Machine;
use crate::friction::{Mode, OUTSIDE, Span};
use kardan_math::num::{Cholesky, dot};

/// Part of a direction outside the multiplier constraints, squared, that counts as none: the square of the accuracy of
/// an event's position.
const VANISHED: f64 = 1e-12;

impl Machine {
    pub(super) fn activate_sticking(&mut self) {
        let sticking = self.sticking();
        self.choose_holding(&sticking);
    }

    /// Directions that stick, except sliders.
    pub(super) fn sticking(&self) -> Vec<usize> {
        self.directions.iter().copied().filter(|&k| self.modes[k] == Mode::Stick).collect()
    }

    /// Multiplier constraints, which are always active, and other directions.
    pub(super) fn with_multipliers(&self, further: &[usize]) -> Vec<usize> {
        self.multiplier_constraints.clone().chain(further.iter().copied()).collect()
    }

    /// Whether a direction depends on multiplier constraints alone at this position.
    pub(super) fn is_carried(&self, k: usize) -> bool {
        !self.multiplier_constraints.is_empty()
            && self.span(&self.with_multipliers(&[])).rejected(self.metric_row(k)) <= VANISHED
    }

    /// A direction over the reduced coordinates at the point last evaluated.
    pub(super) fn friction_row(&self, k: usize) -> &[f64] {
        let r = self.degrees_of_freedom;
        &self.work.friction_rows[k * r..(k + 1) * r]
    }

    /// A friction direction in the metric of the inverse inertia.
    pub(super) fn metric_row(&self, k: usize) -> Vec<f64> {
        let mut row = self.friction_row(k).to_vec();
        self.work.factor.half_solve(&mut row);
        row
    }

    /// Whether a direction is certainly no combination of the active ones, whose factor is known: in the metric of the
    /// inverse inertia more than half of its square is outside of their span.
    pub(super) fn is_outside(&self, k: usize) -> bool {
        let row = self.friction_row(k);
        let mut weighted = row.to_vec();
        self.work.factor.solve(&mut weighted);
        let own = dot(row, &weighted);
        let component = |&a: &usize| self.dynamics.friction_component(a, &weighted, &self.work);
        let right: Vec<f64> = self.holding.iter().map(component).collect();
        let mut shares = right.clone();
        self.active_factor.solve(&mut shares);
        dot(&right, &shares) < 0.5 * own
    }

    /// The span of directions, built from independent ones: multiplier constraints, then the most independent first.
    pub(super) fn span(&self, directions: &[usize]) -> Span {
        let multiplier_count = directions.iter().filter(|k| self.multiplier_constraints.contains(k)).count();
        Span::new(directions.iter().map(|&k| (k, self.metric_row(k))), multiplier_count, self.degrees_of_freedom)
    }

    /// Memory for the active directions, not computed yet.
    pub(super) fn prepare_holding(&mut self) {
        self.active_factor = Cholesky::new(self.holding.len());
        self.torque_distribution.choose(&self.holding, &self.following);
        (self.active_distribution, self.torque_distribution_unique) = (false, false);
        self.response.iter_mut().for_each(|response| response.valid = false);
        let sticking = self.torque_distribution.sticking.iter();
        self.active_constant =
            self.dynamics.has_constant_inertia() && sticking.copied().all(|k| !self.dynamics.friction_varies(k));
    }

    /// Chooses independent directions among multiplier constraints and the given ones, and notes which coordinates are
    /// at rest.
    pub(super) fn choose_holding(&mut self, sticking: &[usize]) {
        let r = self.degrees_of_freedom;
        let all = self.with_multipliers(sticking);
        let sticking = all.as_slice();
        // Some of those that are independent at all positions, with one that certainly is no combination of them.
        let is_constant = self.active_constant && self.following.is_empty();
        let mut new = sticking.iter().filter(|k| !self.holding.contains(k));
        let all = self.holding.len() < sticking.len() && self.holding.iter().all(|k| sticking.contains(k));
        match (new.next(), new.next()) {
            (None, _) if is_constant => self.holding.retain(|k| sticking.contains(k)),
            (Some(&one), None) if is_constant && all && self.is_outside(one) => self.holding.push(one),
            _ => self.holding = self.span(sticking).members,
        }
        let follows = |k: &usize| !self.holding.contains(k) && !self.multiplier_constraints.contains(k);
        self.following = sticking.iter().copied().filter(follows).collect();
        self.prepare_holding();
        self.still.clear();
        self.at_rest = r > 0 && self.holding.len() == r && self.holding.iter().all(|&k| !self.moving[k]);
        if self.at_rest {
            self.still.extend(0..r);
        } else {
            self.find_still(sticking);
        }
        self.turning.clear();
        if !self.multiplier_constraints.is_empty() && !self.at_rest {
            let may = |k: &&usize| !self.moving[**k] && self.is_carried(**k);
            self.turning = self.following.iter().filter(may).copied().collect();
        }
        self.factor_holding();
    }

    /// Coordinates at rest because of sticking directions: those that equal one direction at every position, and those
    /// that follow from directions that do not rotate.
    fn find_still(&mut self, sticking: &[usize]) {
        let rests = |k: &usize| !self.moving[*k] && !self.multiplier_constraints.contains(k);
        let fixed = |k: &usize| rests(k) && !self.dynamics.friction_varies(*k);
        let only = |k: usize| self.dynamics.only_entry(k, &self.work);
        // Every sticking direction is at rest, whether it is independent or dependent; beside multiplier constraints,
        // which may rotate, the active ones and those that depend on these alone.
        let own: Vec<usize> = self.holding.iter().copied().filter(fixed).collect();
        let uncoupled = self.multiplier_constraints.is_empty() && own.iter().all(|&k| only(k).is_some());
        let span = if uncoupled { None } else { Some(self.span(&own)) };
        let stays = |k: &usize| {
            self.multiplier_constraints.is_empty()
                || self.holding.contains(k)
                || span.as_ref().is_some_and(|span| fixed(k) && span.rejected(self.metric_row(*k)) <= OUTSIDE)
        };
        let still = sticking.iter().copied().filter(|k| rests(k) && stays(k)).filter_map(only);
        let mut still: Vec<usize> = still.collect();
        if let Some(span) = span {
            let mut unit = vec![0.0; self.degrees_of_freedom];
            for i in 0..self.degrees_of_freedom {
                if still.contains(&i) {
                    continue;
                }
                unit.fill(0.0);
                unit[i] = 1.0;
                self.work.factor.half_solve(&mut unit);
                if span.rejected(unit.clone()) <= OUTSIDE {
                    still.push(i);
                }
            }
        }
        self.still = still;
    }

    /// Speeds in the active directions become zero: `v −= H⁻¹Gᵀ (G H⁻¹Gᵀ)⁻¹ G v`.
    pub(super) fn stop_along_holding(&mut self, state: &mut [f64]) {
        let r = self.degrees_of_freedom;
        self.factor_holding();
        let count = self.holding.len();
        let component = |&k: &usize| match k.checked_sub(self.multiplier_constraints.start) {
            Some(row) => self.work.more(&self.dynamics, self.places.multiplier_speeds.start + row),
            None if self.moving[k] => self.dynamics.friction_speed(k, &self.work),
            None => dot(self.friction_row(k), &state[r..2 * r]),
        };
        let mut lambda: Vec<f64> = self.holding.iter().map(component).collect();
        self.active_factor.solve(&mut lambda);
        if self.at_rest {
            state[r..2 * r].fill(0.0);
        } else {
            for a in 0..count {
                for i in 0..r {
                    state[r + i] -= self.weighted[a * r + i] * lambda[a];
                }
            }
        }
        for &i in &self.still {
            state[r + i] = 0.0;
        }
    }
}
