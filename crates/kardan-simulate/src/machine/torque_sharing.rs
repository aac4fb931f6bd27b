//! The torque of sticking directions that depend on each other: how it is distributed among them, and where that is not unique.

use super::Machine;
use super::torque_distribution::{Holding, TorqueDistribution};
use kardan_math::num::dot;

impl Machine {
    /// Distributes the torque among sticking directions that depend on each other: the smallest torques relative to the
    /// stick limit of each direction where these suffice, else those of the convex problem.
    pub(super) fn split_friction(&mut self) {
        if self.share_active(1.0 + 1e-9) {
            let TorqueDistribution { sticking, torques, .. } = &self.torque_distribution;
            sticking.iter().zip(torques).for_each(|(&k, torque)| self.friction_torques[k] = *torque);
            return;
        }
        let loaded = if self.gear_losses.is_empty() { None } else { self.shared_torques() };
        let (sticking, torques) = loaded.unwrap_or_else(|| {
            let sticking = self.torque_distribution.sticking.clone();
            let (_, torques) = self.solve_box(&sticking);
            (sticking, torques)
        });
        for (torque, &k) in torques.iter().zip(&sticking) {
            self.friction_torques[k] = *torque;
        }
    }

    /// Whether the sticking directions stay at rest with the smallest torques relative to their stick limits, none
    /// above its limit times `most`. Needs the torques of the independent sticking directions.
    pub(super) fn share_active(&mut self, most: f64) -> bool {
        self.factor_holding();
        if !self.prepare_torque_distribution() {
            return false;
        }
        let c = &self.bounds[0];
        let determined = self.torque_distribution.share(&self.active_torque[..self.holding.len()], c);
        let TorqueDistribution { sticking, torques, .. } = &self.torque_distribution;
        determined && sticking.iter().zip(torques).all(|(&k, torque)| torque.abs() <= c[k] * most)
    }

    /// Whether the sticking directions distribute their torque in the same way at all positions; then the distribution
    /// is prepared here.
    pub(super) fn shares_evenly(&mut self) -> bool {
        self.active_constant && self.prepare_torque_distribution()
    }

    fn prepare_torque_distribution(&mut self) -> bool {
        // The limits of gear losses depend on the distribution.
        if !self.shares_by_size() || !self.gear_losses.is_empty() {
            return false;
        }
        let c = &self.bounds[0];
        if !(self.active_constant && self.torque_distribution_unique && !self.unilaterals.changes) {
            let holding = Holding { directions: &self.holding, weighted: &self.weighted, factor: &self.active_factor };
            self.torque_distribution.prepare(&holding, &self.work.friction_rows, c);
            self.torque_distribution_unique = true;
        }
        true
    }

    /// A direction as a combination of the independent sticking ones.
    pub(super) fn shares_of_holding(&self, direction: usize) -> Vec<f64> {
        let (r, row) = (self.degrees_of_freedom, self.friction_row(direction));
        let holding = 0..self.holding.len();
        let mut shares: Vec<f64> = holding.map(|a| dot(&self.weighted[a * r..(a + 1) * r], row)).collect();
        self.active_factor.solve(&mut shares);
        shares
    }

    /// Names of sticking directions whose torques are not unique.
    pub fn shared_friction(&self) -> Vec<usize> {
        if self.following.is_empty() {
            return Vec::new();
        }
        // A dependent direction shares torque with the active ones that it is a combination of; one in which no motion
        // is possible shares none.
        let mut out = Vec::new();
        for &f in &self.following {
            let shares = self.shares_of_holding(f);
            let largest = shares.iter().fold(0.0f64, |max, x| max.max(x.abs()));
            let with = self.holding.iter().zip(&shares).filter(|(_, share)| share.abs() > 1e-9 * largest);
            let with = with.map(|(k, _)| *k).filter(|k| !self.multiplier_constraints.contains(k));
            let with: Vec<usize> = with.collect();
            // A direction that multiplier constraints alone determine does not move, for any friction.
            if largest > 0.0 && !with.is_empty() {
                out.push(f);
            }
            out.extend(with);
        }
        out.sort_unstable();
        out.dedup();
        out
    }
}
