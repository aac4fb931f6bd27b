//! Accelerations with gear losses, and the limits of gears at rest.

use super::Machine;
use super::gear_losses::GearLosses;
use crate::friction::Mode;
use kardan_math::num::dot;

impl Machine {
    /// Accelerations and constraint torques in the current modes with the gear losses, which `force` then includes; and
    /// the limits of gears at rest. Needs the factors of the active directions.
    pub(super) fn load_gears(&mut self) {
        let mut gear_losses = std::mem::take(&mut self.gear_losses);
        // Without the losses.
        for (&k, torque) in gear_losses.directions.iter().zip(&mut gear_losses.torques) {
            self.act(k, std::mem::take(torque));
        }
        self.accelerate_constrained();
        self.read_loads(&mut gear_losses);
        gear_losses.give(self.work.values());
        (gear_losses.ambiguous, gear_losses.jammed, gear_losses.undefined) = (None, None, None);
        gear_losses.sliding.clear();
        for (gear, &k) in gear_losses.directions.iter().enumerate().filter(|(_, k)| self.modes[**k] != Mode::Stick) {
            gear_losses.sliding.push((gear, self.modes[k].sign()));
        }
        if !gear_losses.sliding.is_empty() {
            gear_losses.base.clone_from(&gear_losses.loads);
            for place in 0..gear_losses.sliding.len() {
                let gear = gear_losses.sliding[place].0;
                self.find_influence(&mut gear_losses, gear);
            }
            let solved = gear_losses.solve();
            gear_losses.note_ambiguity(solved);
            for &(gear, _) in &gear_losses.sliding {
                self.act(gear_losses.directions[gear], -gear_losses.torques[gear]);
            }
            self.accelerate_constrained();
            self.read_loads(&mut gear_losses);
        }
        self.bound_gear_losses(&mut gear_losses);
        self.gear_losses = gear_losses;
    }

    /// Adds a torque in a direction to the force.
    pub(super) fn act(&mut self, direction: usize, torque: f64) {
        if torque != 0.0 {
            let r = self.degrees_of_freedom;
            let row = &self.work.friction_rows[direction * r..(direction + 1) * r];
            self.force.iter_mut().zip(row).for_each(|(force, x)| *force += x * torque);
        }
    }

    /// The gear loads with the accelerations, and with the torques of active and sliding directions.
    fn read_loads(&self, gear_losses: &mut GearLosses) {
        let multipliers = self.holding.iter().copied().zip(self.active_torque.iter().copied());
        self.read_loads_of(gear_losses, multipliers);
    }

    /// The same with other constraint torques.
    pub(super) fn read_loads_of(
        &self,
        gear_losses: &mut GearLosses,
        multipliers: impl Iterator<Item = (usize, f64)> + Clone,
    ) {
        let r = self.degrees_of_freedom;
        let of = |place: usize| self.work.more(&self.dynamics, place);
        let directions = self.multiplier_constraints.end;
        for gear in 0..gear_losses.directions.len() {
            let first = self.places.gear_load_by_acceleration.start + gear * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * self.acceleration[i]).sum();
            let first = self.places.gear_load_by_torque.start + gear * directions;
            let all =
                multipliers.clone().chain(gear_losses.losses()).chain(gear_losses.starting_friction.iter().copied());
            let rubbed: f64 = all.map(|(k, torque)| of(first + k) * torque).sum();
            gear_losses.loads[gear] = of(self.places.gear_loads.start + gear) + moved + rubbed;
        }
    }

    /// The change of all gear loads per unit of the loss of a sliding gear.
    fn find_influence(&mut self, gear_losses: &mut GearLosses, gear: usize) {
        let (r, count, holding) = (self.degrees_of_freedom, gear_losses.directions.len(), self.holding.len());
        let direction = gear_losses.directions[gear];
        let GearLosses { change, multipliers, influence, .. } = gear_losses;
        change.clear();
        change.extend(self.work.friction_rows[direction * r..(direction + 1) * r].iter().map(|x| -x));
        multipliers.clear();
        if holding == r {
            multipliers.extend((0..holding).map(|a| dot(&self.weighted[a * r..(a + 1) * r], change)));
            self.active_factor.solve(multipliers);
            change.fill(0.0);
        } else {
            self.work.factor.solve(change);
            multipliers.extend(self.holding.iter().map(|&k| self.dynamics.friction_component(k, change, &self.work)));
            self.active_factor.solve(multipliers);
            for (a, torque) in multipliers.iter().enumerate() {
                let row = &self.weighted[a * r..(a + 1) * r];
                change.iter_mut().zip(row).for_each(|(x, weight)| *x -= weight * torque);
            }
        }
        let of = |place: usize| self.work.more(&self.dynamics, place);
        for row in 0..count {
            let first = self.places.gear_load_by_acceleration.start + row * r;
            let moved: f64 = (0..r).map(|i| of(first + i) * change[i]).sum();
            let first = self.places.gear_load_by_torque.start + row * self.multiplier_constraints.end;
            let carried: f64 = self.holding.iter().zip(&*multipliers).map(|(k, torque)| of(first + k) * torque).sum();
            influence[row * count + gear] = moved + carried + of(first + direction);
        }
    }

    /// The limits of gears at rest in both directions at their loads.
    pub(super) fn bound_gear_losses(&mut self, gear_losses: &mut GearLosses) {
        gear_losses.negative = None;
        // Against motion forward, then backward; the first body drives where the torque of the gear opposes the motion.
        for (bounds, sense) in self.bounds.iter_mut().zip([1.0, -1.0]) {
            gear_losses.evaluate(|_, load| load * sense <= 0.0);
            for (&k, loss) in gear_losses.directions.iter().zip(&gear_losses.losses) {
                bounds[k] = loss.max(0.0);
                if *loss < gear_losses.negative.map_or(0.0, |(_, least)| least) {
                    gear_losses.negative = Some((k, *loss));
                }
                if !loss.is_finite() {
                    gear_losses.undefined = Some(k);
                }
            }
        }
    }

    /// Gears that the inertia of their load would lock at a state, while they slide and no direction sticks: the loss
    /// grows by more than the torque that causes it. None beside multiplier constraints.
    pub(crate) fn self_locking_gears(&mut self, state: &[f64]) -> Vec<usize> {
        if self.gear_losses.is_empty() || !self.multiplier_constraints.is_empty() || !self.forces(0.0, state) {
            return Vec::new();
        }
        let mut gear_losses = std::mem::take(&mut self.gear_losses);
        gear_losses.give(self.work.values());
        self.holding.clear();
        let count = gear_losses.directions.len();
        (0..count).for_each(|gear| self.find_influence(&mut gear_losses, gear));
        gear_losses.loads.fill(0.0);
        gear_losses.evaluate(|_, _| false);
        let locks = |gear: &usize| gear_losses.slopes[*gear] * gear_losses.influence[gear * count + gear] >= 1.0;
        let found = (0..count).filter(locks).map(|gear| gear_losses.directions[gear]).collect();
        self.gear_losses = gear_losses;
        found
    }
}
