//! How far each friction direction is from leaving its contact state, and which slipping directions have reversed.

use super::Machine;
use crate::friction::{Mode, NOISE};
use kardan_math::num::dot;

impl Machine {
    /// Uses the integrator step between two states as the scale of events in it; `length` (s) is that of the step
    /// before it was shortened for an event.
    pub fn measure_step(&mut self, length: f64, from: &[f64], to: &[f64]) {
        let speeds = self.degrees_of_freedom..2 * self.degrees_of_freedom;
        self.step_length = length;
        for ((size, a), b) in self.step_speeds.iter_mut().zip(&from[speeds.clone()]).zip(&to[speeds]) {
            *size = a.abs().max(b.abs());
        }
    }

    /// The distance of each direction from leaving its mode at the point last evaluated: the remaining part of the
    /// breakaway torque for sticking directions, the speed (rad/s) of slipping ones; infinite for dependent ones.
    pub fn margins_here(&mut self, out: &mut [f64]) {
        for (k, margin) in out.iter_mut().enumerate() {
            *margin = self.slip_margin(k);
        }
        let frictions = out.len();
        let shared = self.room_beside_teeth();
        for (&k, torque) in self.holding.iter().zip(&self.active_torque).filter(|(k, _)| **k < frictions) {
            out[k] = shared.unwrap_or_else(|| self.room_of(k, *torque));
        }
        self.lock_margins().for_each(|(k, margin)| out[k] = margin);
        self.jenkins_margins().for_each(|(k, room)| out[k] = room);
    }

    /// [`Machine::margins_here`] of one direction.
    pub fn margin_here(&mut self, direction: usize) -> f64 {
        if let Some((_, room)) = self.jenkins_margins().find(|(k, _)| *k == direction) {
            return room;
        }
        if let Some((_, margin)) = self.lock_margins().find(|(k, _)| *k == direction) {
            return margin;
        }
        let Some(a) = self.holding.iter().position(|k| *k == direction) else { return self.slip_margin(direction) };
        self.room_beside_teeth().unwrap_or_else(|| self.room_of(direction, self.active_torque[a]))
    }

    /// The common margin of sticking directions that share torques with gears, whose limits depend on the distribution.
    fn room_beside_teeth(&mut self) -> Option<f64> {
        (!self.gear_losses.is_empty() && !self.following.is_empty()).then(|| self.shared_room())
    }

    /// The distance of a slipping direction from rest at a time and a state, rad/s: negative beyond.
    pub fn slip_room(&mut self, time: f64, state: &[f64], direction: usize) -> f64 {
        self.find_shafts(time, state);
        self.slip_margin(direction)
    }

    /// The distance of the sticking directions from their limits at the point last evaluated, as a part of those:
    /// negative beyond. Where they share torques, with the torques of least norm, which is less than the largest
    /// possible margin.
    pub fn active_reserve(&mut self) -> f64 {
        if !self.following.is_empty() {
            self.share_active(1.0);
        }
        let beside_teeth = self.room_beside_teeth();
        let shared = self.torque_distribution.sticking.iter().zip(&self.torque_distribution.torques);
        let uncoupled = self.holding.iter().zip(&self.active_torque);
        let least = |room: f64, (&k, torque): (&usize, &f64)| room.min(self.room_of(k, *torque));
        let room = match beside_teeth {
            Some(room) => room,
            None if self.following.is_empty() => uncoupled.fold(1.0, least),
            None => shared.fold(1.0, least),
        };
        let rooms = self.jenkins_margins().chain(self.lock_margins());
        rooms.fold(room, |least, (_, room)| least.min(room))
    }

    /// Slipping directions whose speed has the wrong sign at this time and point of the step, beyond rounding.
    pub fn reversed(&mut self, time: f64, state: &[f64], out: &mut Vec<usize>) {
        out.clear();
        // Multiplier constraints may rotate away from directions that depend on them alone.
        let turns = !self.turning.is_empty();
        if self.unilaterals.is_empty() && !turns && !self.modes.iter().any(|mode| *mode != Mode::Stick) {
            return;
        }
        self.find_shafts(time, state);
        let against = |this: &Self, k: usize| {
            // Stops and soft stops change by their gaps and contact torques.
            let slips = if this.unilaterals.slips(k) { this.modes[k].sign() } else { 0.0 };
            -slips * this.dynamics.friction_speed(k, &this.work)
        };
        out.extend((0..self.modes.len()).filter(|&k| against(self, k) > 0.0 || self.contact_changes(k)));
        if out.is_empty() && !turns {
            return;
        }
        // The cancellation in the speeds depends on the directions there.
        self.update(state);
        let noise = |k: usize| {
            let of_terms = || NOISE * self.dynamics.friction_terms(k, &self.step_speeds, &self.work);
            let own = self.noise_of_slip(k).unwrap_or_else(of_terms);
            if self.multiplier_constraints.is_empty() { own } else { own.max(self.noise_of_rows(k)) }
        };
        out.retain(|&k| against(self, k) > noise(k) || self.contact_changes(k));
        // Those that these have carried along have a speed beyond rounding.
        let moves = |k: &usize| self.dynamics.friction_speed(*k, &self.work).abs() > self.noise_of_rows(*k);
        out.extend(self.turning.iter().copied().filter(moves));
    }

    /// The rounding error of the speed in a direction where multiplier constraints couple it to others: in the metric
    /// of the inertia, of all speeds.
    fn noise_of_rows(&self, k: usize) -> f64 {
        let r = self.degrees_of_freedom;
        let sizes = &self.step_speeds;
        let row_dot = |row: &[f64]| row.iter().zip(sizes).map(|(x, size)| x.abs() * size).sum::<f64>();
        let momenta = self.work.inertia.chunks_exact(r.max(1)).map(row_dot);
        // |g v| ≤ |g| |v| in the metric of the inertia.
        let size = momenta.zip(sizes).map(|(momentum, size)| momentum * size).sum::<f64>().sqrt();
        let row = self.metric_row(k);
        NOISE * size * dot(&row, &row).sqrt()
    }
}
