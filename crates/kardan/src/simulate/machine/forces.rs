//! Forces and accelerations in one set of modes.

use super::Machine;
use super::wired::{Computer, seen};
use crate::num::dot;
use crate::simulate::drive::Rate;
use crate::simulate::friction::Mode;
use crate::simulate::scenario::SourceTarget;

impl Machine {
    pub(super) fn set_sources(&mut self, time: f64) {
        for (value, (at, slope, start)) in self.sources.iter_mut().zip(&self.lines) {
            *value = at + slope * (time - start);
        }
    }

    /// Takes the lines of all sources that hold from a time on.
    pub fn enter_segment(&mut self, time: f64) {
        for (line, profile) in self.lines.iter_mut().zip(&self.profiles) {
            *line = profile.piece(time);
        }
    }

    /// Kinematics, sources, commands, torques and the force without friction. False if the inertia is singular.
    pub(super) fn forces(&mut self, time: f64, state: &[f64]) -> bool {
        let r = self.degrees_of_freedom;
        let regular = self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        self.set_sources(time);
        self.commands.fill(0.0);
        for (target, value) in self.targets.iter().zip(&self.sources) {
            if let SourceTarget::Input(input) = target {
                self.commands[*input] += value;
            }
        }
        for wired in &mut self.laws {
            let law = match &mut wired.computer {
                Computer::Continuous(law) => law,
                Computer::Clocked(clocked) => {
                    for (&input, command) in wired.inputs.iter().zip(&clocked.held) {
                        self.commands[input] += command;
                    }
                    continue;
                }
            };
            for (value, &source) in wired.reference_values.iter_mut().zip(&wired.references) {
                *value = self.sources[source];
            }
            let seen = seen(&self.work.kinematics, &wired.reference_values, &state[wired.states.clone()]);
            law.command(seen, &mut wired.commands);
            for (&input, command) in wired.inputs.iter().zip(&wired.commands) {
                self.commands[input] += command;
            }
        }
        self.force.copy_from_slice(&self.work.passive);
        for (k, drive) in self.drives.iter().enumerate() {
            let torque = match drive.lag_state {
                Some(place) => state[place],
                None => drive.after_rate(self.commands[k], state),
            };
            self.torques[k] = torque;
            let torque = match drive.ripple {
                Some((size, order)) => torque + size * (order * self.dynamics.input_angle(k, &self.work)).sin(),
                None => torque,
            };
            self.applied[k] = torque;
            for (force, g) in self.force.iter_mut().zip(&self.work.input_rows[k * r..(k + 1) * r]) {
                *force += torque * g;
            }
        }
        regular
    }

    /// Adds the friction of slipping directions to the force.
    pub(super) fn slip_forces(&mut self) {
        for (k, mode) in self.modes.iter().enumerate() {
            if *mode != Mode::Stick {
                let speed = self.dynamics.friction_speed(k, &self.work);
                let torque = mode.sign() * self.dynamics.sliding_torque(k, speed);
                self.dynamics.add_along_friction(k, -torque, &mut self.force, &self.work);
            }
        }
    }

    /// The accelerations in the current modes, from the force with slip friction.
    pub(super) fn accelerate(&mut self) {
        let r = self.degrees_of_freedom;
        self.acceleration.copy_from_slice(&self.force);
        self.work.factor.solve(&mut self.acceleration);
        let count = self.holding.len();
        if count == 0 {
            return;
        }
        if count == r {
            // Nothing moves: with all speeds zero, every acceleration bias vanishes too.
            self.acceleration.fill(0.0);
            self.hold_torques_of_force();
            return;
        }
        self.factor_holding();
        for a in 0..count {
            self.hold_torque[a] = self.hold_defect(a);
        }
        self.hold_factor.solve(&mut self.hold_torque[..count]);
        self.scratch[..count].copy_from_slice(&self.hold_torque[..count]);
        self.take_from_acceleration();
        // One refinement keeps the sticking speeds at zero to the last bits.
        for a in 0..count {
            self.scratch[a] = self.hold_defect(a);
        }
        self.hold_factor.solve(&mut self.scratch[..count]);
        for a in 0..count {
            self.hold_torque[a] += self.scratch[a];
        }
        self.take_from_acceleration();
        for &i in &self.still {
            self.acceleration[i] = 0.0;
        }
    }

    /// Acceleration along a holding direction.
    fn hold_defect(&self, a: usize) -> f64 {
        let k = self.holding[a];
        self.dynamics.along_friction(k, &self.acceleration, &self.work) + self.work.friction_bias[k]
    }

    /// Takes what torques along the holding directions (in `scratch`) do from the accelerations.
    fn take_from_acceleration(&mut self) {
        let r = self.degrees_of_freedom;
        for (torque, weighted) in self.scratch[..self.holding.len()].iter().zip(self.weighted.chunks_exact(r)) {
            self.acceleration.iter_mut().zip(weighted).for_each(|(x, weight)| *x -= weight * torque);
        }
    }

    /// `weighted = H⁻¹ Gᵀ` and the factor of `G H⁻¹ Gᵀ` over the holding directions; where neither depends on the position, once.
    pub(super) fn factor_holding(&mut self) {
        if self.hold_constant && self.hold_known {
            return;
        }
        self.hold_known = true;
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        for a in 0..count {
            let k = self.holding[a];
            let row = &mut self.weighted[a * r..(a + 1) * r];
            row.copy_from_slice(&self.work.friction_rows[k * r..(k + 1) * r]);
            self.work.factor.solve(row);
        }
        for a in 0..count {
            for b in 0..count {
                let k = self.holding[b];
                self.hold_matrix[a * count + b] =
                    dot(&self.weighted[a * r..(a + 1) * r], &self.work.friction_rows[k * r..(k + 1) * r]);
            }
        }
        self.hold_factor.factor(&self.hold_matrix[..count * count]);
    }

    /// Holding torques when everything stands still: `Gᵀ λ = force`.
    pub(super) fn hold_torques_of_force(&mut self) {
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        self.factor_holding();
        for a in 0..count {
            self.hold_torque[a] = dot(&self.weighted[a * r..(a + 1) * r], &self.force);
        }
        self.hold_factor.solve(&mut self.hold_torque[..count]);
    }

    /// The right-hand side in the current modes.
    pub fn derivative(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let r = self.degrees_of_freedom;
        if !self.forces(time, state) {
            out.fill(f64::NAN);
            return;
        }
        self.slip_forces();
        self.accelerate();
        out[..r].copy_from_slice(&state[r..2 * r]);
        for &i in &self.still {
            out[i] = 0.0;
        }
        out[r..2 * r].copy_from_slice(&self.acceleration);
        let mut input_power = 0.0;
        for (k, drive) in self.drives.iter().enumerate() {
            if let (Some(place), Some(rate)) = (drive.rate_state, drive.rate) {
                out[place] = match drive.rate_mode {
                    Rate::Follow => 0.0,
                    Rate::Rise => rate,
                    Rate::Fall => -rate,
                };
            }
            if let (Some(place), Some(lag)) = (drive.lag_state, drive.lag) {
                out[place] = (drive.after_rate(self.commands[k], state) - state[place]) / lag;
            }
            input_power += self.applied[k] * self.dynamics.input_speed(k, &self.work);
        }
        for wired in self.laws.iter_mut().filter(|wired| !wired.states.is_empty()) {
            for (torque, &input) in wired.torques.iter_mut().zip(&wired.inputs) {
                *torque = self.torques[input];
            }
            let seen = seen(&self.work.kinematics, &wired.reference_values, &state[wired.states.clone()]);
            if let Computer::Continuous(law) = &mut wired.computer {
                law.rates(seen, &wired.torques, &mut out[wired.states.clone()]);
            }
        }
        let mut dissipated = self.dynamics.damping_power(&self.work);
        for (k, mode) in self.modes.iter().enumerate() {
            let speed = self.dynamics.friction_speed(k, &self.work);
            dissipated += mode.sign() * self.dynamics.sliding_torque(k, speed) * speed;
        }
        out[self.size - 2] = input_power;
        out[self.size - 1] = dissipated;
    }

    /// Everything that outputs are read from: accelerations, motor torques, friction torques, at one point.
    pub fn observe(&mut self, time: f64, state: &[f64]) {
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
        for (k, mode) in self.modes.iter().enumerate() {
            let speed = self.dynamics.friction_speed(k, &self.work);
            self.friction_torques[k] = mode.sign() * self.dynamics.sliding_torque(k, speed);
        }
        for a in 0..self.holding.len() {
            self.friction_torques[self.holding[a]] = self.hold_torque[a];
        }
        if !self.following.is_empty() {
            self.split_friction();
        }
    }

    /// Angles, speeds and sources at one point.
    pub fn observe_motion(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        self.work.kinematics.update(&state[..r], &state[r..2 * r]);
        self.set_sources(time);
    }

    /// Pairs of numbers whose products add up to the power of the inputs, and to that of the viscous loss, W, at the point last evaluated.
    pub fn power_factors(&self) -> [Vec<[f64; 2]>; 2] {
        let input = |k: usize| [self.applied[k], self.dynamics.input_speed(k, &self.work)];
        let damper = |k: usize| self.dynamics.damper_factors(k, &self.work);
        [(0..self.applied.len()).map(input).collect(), (0..self.dynamics.damper_count()).map(damper).collect()]
    }

    /// Whether nothing depends on time until the segment ends: all sources keep their values, and sampled laws their torques.
    pub fn is_steady(&self) -> bool {
        self.lines.iter().all(|(_, slope, _)| *slope == 0.0)
    }

    /// Evaluates forces and accelerations in the present modes.
    pub fn evaluate(&mut self, time: f64, state: &[f64]) {
        self.forces(time, state);
        self.slip_forces();
        self.accelerate();
    }

    /// Kinetic and potential energy at a state, J.
    pub fn energy(&mut self, state: &[f64]) -> f64 {
        let r = self.degrees_of_freedom;
        self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work);
        self.dynamics.energy(&self.work)
    }
}
