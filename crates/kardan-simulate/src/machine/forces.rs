//! Forces and accelerations in one set of modes.

use super::Machine;
use super::connected_law::{Computer, ConnectedLaw, observation};
use super::expressions::read;
use crate::drive::Drive;
use crate::friction::Mode;
use kardan_math::num::dot;

impl Machine {
    /// Values of the sources at a time of the segment.
    pub(crate) fn set_sources(&mut self, time: f64) {
        for &source in &self.timed.ramps {
            let (at, slope, start) = self.lines[source];
            self.sources[source] = at + slope * (time - start);
        }
    }

    /// Takes the lines of all sources, and pieces of functions of time, that are valid from a time on.
    pub fn enter_segment(&mut self, time: f64) {
        self.timed.enter(time);
        self.enter_faults(time);
        self.dynamics.enter_faults(time);
        for (line, profile) in self.lines.iter_mut().zip(&self.profiles) {
            *line = profile.piece(time);
        }
        for (value, (at, slope, start)) in self.sources.iter_mut().zip(&self.lines) {
            *value = at + slope * (time - start);
        }
        self.find_what_rests();
    }

    /// Computes the values that are constant until the next breakpoint, or sample.
    pub(super) fn find_what_rests(&mut self) {
        self.timed.ramps.clear();
        self.timed.ramps.extend((0..self.lines.len()).filter(|&source| self.lines[source].1 != 0.0));
        self.timed.limits_rest = self.no_limit_moves();
    }

    /// Passes all inputs except angles and speeds at a state to the expressions of the loop: sources, and the commands
    /// of laws with own computation.
    pub(super) fn give_loop(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        self.set_sources(time);
        self.zoh_output.fill(0.0);
        if self.own_laws {
            self.timed.find_sources(&self.sources, time, state);
            self.give_time(time, state);
            self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
        }
        // Blocks have no commands.
        for connected in self.laws.iter_mut().filter(|connected| !connected.inputs.is_empty()) {
            let ConnectedLaw { computer, inputs, references, reference_values, commands, states, .. } = connected;
            match computer {
                Computer::Linear(_) | Computer::Inlined(_) => continue,
                Computer::SampledRuntime(sampled) => commands.copy_from_slice(&sampled.zoh_output),
                Computer::Continuous(law) => {
                    for (value, &source) in reference_values.iter_mut().zip(&*references) {
                        *value = self.timed.values[source];
                    }
                    let kinematics = &self.work.kinematics;
                    let observation = observation(time, kinematics, reference_values, &state[states.clone()]);
                    law.command(observation, commands);
                }
            }
            inputs.iter().zip(commands).for_each(|(&input, command)| self.zoh_output[input] += *command);
        }
        self.give(time, state);
    }

    /// Kinematics, sources, commands, torques and the force with the friction of slipping directions. False if the inertia is singular.
    pub(super) fn forces(&mut self, time: f64, state: &[f64]) -> bool {
        self.give_loop(time, state);
        let regular = self.update(state);
        self.gear_losses.torques.fill(0.0);
        let Self { dynamics, work, places, .. } = self;
        read(dynamics, work, &places.commands, &mut self.commands);
        read(dynamics, work, &places.torques, &mut self.torques);
        read(dynamics, work, &places.applied, &mut self.applied);
        read(dynamics, work, &places.forces, &mut self.force);
        if self.unilaterals.changes {
            self.find_bounds();
        }
        regular
    }

    /// Evaluates the expressions at a state, with the last inputs. False if the inertia is singular.
    pub(super) fn update(&mut self, state: &[f64]) -> bool {
        let r = self.degrees_of_freedom;
        self.evaluated += 1;
        self.dynamics.update(&state[..r], &state[r..2 * r], &mut self.work)
    }

    /// The inputs of the loop's expressions besides angles and speeds.
    fn give(&mut self, time: f64, state: &[f64]) {
        self.give_time(time, state);
        let Self { dynamics, work, places, .. } = self;
        work.give(dynamics, places.sources.start, self.sources.iter().copied());
        work.give(dynamics, places.zoh_output.start, self.zoh_output.iter().copied());
        work.give(dynamics, places.limits.start, self.drives.iter().flat_map(Drive::leaves));
        work.give(dynamics, places.follows.start, self.drives.iter().map(Drive::follows));
        work.give(dynamics, places.limiter_rates.start, self.drives.iter().map(Drive::limiter_rate));
        let stuck = self.drives.iter().filter(|drive| drive.sticks()).map(|drive| drive.stuck);
        work.give(dynamics, places.stuck.start, stuck);
        work.give(dynamics, places.senses.start, self.modes.iter().map(|mode| mode.sign()));
        if !places.couplings.is_empty() {
            work.give(dynamics, places.couplings.start, self.jenkins.couplings.iter().copied());
        }
    }

    /// The inputs of angles and speeds besides the reduced ones.
    pub(super) fn give_time(&mut self, time: f64, state: &[f64]) {
        let Self { dynamics, work, places, .. } = self;
        if !self.timed.is_empty() {
            work.give(dynamics, places.timed.start, self.timed.at(time).iter().copied());
        }
        work.give(dynamics, places.states.start, state[2 * self.degrees_of_freedom..self.size - 2].iter().copied());
    }

    /// Computes angles and speeds of all shafts, for the speeds in sticking and slipping directions.
    pub(super) fn find_shafts(&mut self, time: f64, state: &[f64]) {
        let r = self.degrees_of_freedom;
        // Other inputs count where speeds are prescribed.
        if self.moves || !self.jenkins.directions.is_empty() {
            self.give_time(time, state);
        }
        self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
    }

    /// The accelerations in the current modes, from the force with slip friction.
    pub(super) fn accelerate(&mut self) {
        if !self.holding.is_empty() {
            self.factor_holding();
        }
        if self.gear_losses.is_empty() {
            self.accelerate_constrained();
        } else {
            self.load_gears();
        }
    }

    /// The same with the present factors.
    pub(super) fn accelerate_constrained(&mut self) {
        let count = self.holding.len();
        if self.at_rest {
            // No motion: with all speeds zero, every acceleration bias vanishes too.
            self.acceleration.fill(0.0);
            self.active_torques_of_force();
            return;
        }
        self.acceleration.copy_from_slice(&self.force);
        self.work.factor.solve(&mut self.acceleration);
        if count == 0 {
            return;
        }
        for a in 0..count {
            self.active_torque[a] = self.active_defect(a);
        }
        self.active_factor.solve(&mut self.active_torque[..count]);
        self.scratch[..count].copy_from_slice(&self.active_torque[..count]);
        self.take_from_acceleration();
        // One refinement gives sticking speeds of zero to the last bits.
        for a in 0..count {
            self.scratch[a] = self.active_defect(a);
        }
        self.active_factor.solve(&mut self.scratch[..count]);
        for a in 0..count {
            self.active_torque[a] += self.scratch[a];
        }
        self.take_from_acceleration();
        for &i in &self.still {
            self.acceleration[i] = 0.0;
        }
    }

    /// Acceleration in an active direction.
    fn active_defect(&self, a: usize) -> f64 {
        let k = self.holding[a];
        self.dynamics.friction_component(k, &self.acceleration, &self.work) + self.work.friction_bias[k]
    }

    /// Subtracts the effect of torques in the active directions (in `scratch`) from the accelerations.
    fn take_from_acceleration(&mut self) {
        let r = self.degrees_of_freedom;
        let rows = self.weighted.chunks_exact(r.max(1)).zip(&self.weighted_parts);
        for (torque, (weighted, part)) in self.scratch[..self.holding.len()].iter().zip(rows) {
            let own = self.acceleration[part.clone()].iter_mut().zip(&weighted[part.clone()]);
            own.for_each(|(x, weight)| *x -= weight * torque);
        }
    }

    /// `weighted = H⁻¹ Gᵀ` and the factor of `G H⁻¹ Gᵀ` over the active directions; where neither depends on the
    /// position, once.
    pub(super) fn factor_holding(&mut self) {
        if self.active_constant && self.active_distribution {
            return;
        }
        self.active_distribution = true;
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        for a in 0..count {
            let k = self.holding[a];
            let row = &mut self.weighted[a * r..(a + 1) * r];
            row.copy_from_slice(&self.work.friction_rows[k * r..(k + 1) * r]);
            self.work.factor.solve(row);
            let first = row.iter().position(|x| *x != 0.0).unwrap_or(0);
            self.weighted_parts[a] = first..row.iter().rposition(|x| *x != 0.0).map_or(first, |last| last + 1);
        }
        for a in 0..count {
            let weighted = &self.weighted[a * r..(a + 1) * r];
            for b in 0..count {
                self.active_matrix[a * count + b] =
                    self.dynamics.friction_component(self.holding[b], weighted, &self.work);
            }
        }
        self.active_factor.factor(&self.active_matrix[..count * count]);
    }

    /// Constraint torques when all coordinates are at rest: `Gᵀ λ = force`.
    pub(super) fn active_torques_of_force(&mut self) {
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        for a in 0..count {
            self.active_torque[a] = dot(&self.weighted[a * r..(a + 1) * r], &self.force);
        }
        self.active_factor.solve(&mut self.active_torque[..count]);
    }

    /// The right-hand side in the current modes.
    pub fn derivative(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let r = self.degrees_of_freedom;
        if !self.forces(time, state) {
            out.fill(f64::NAN);
            return;
        }
        self.note_arguments();
        self.accelerate();
        out[..r].copy_from_slice(&state[r..2 * r]);
        for &i in &self.still {
            out[i] = 0.0;
        }
        out[r..2 * r].copy_from_slice(&self.acceleration);
        read(&self.dynamics, &self.work, &self.places.rates, &mut out[2 * r..self.size - 2]);
        for connected in self.laws.iter_mut().filter(|connected| !connected.states.is_empty()) {
            let ConnectedLaw { computer, inputs, reference_values, torques, states, .. } = connected;
            let Computer::Continuous(law) = computer else { continue };
            for (torque, &input) in torques.iter_mut().zip(&*inputs) {
                *torque = self.torques[input];
            }
            let observation = observation(time, &self.work.kinematics, reference_values, &state[states.clone()]);
            law.rates(observation, torques, &mut out[states.clone()]);
        }
        read(&self.dynamics, &self.work, &self.places.powers, &mut out[self.size - 2..]);
        for (k, torque) in self.gear_losses.losses() {
            out[self.size - 1] += torque * self.dynamics.friction_speed(k, &self.work);
        }
        if self.gear_losses.jammed.is_some() {
            self.gear_losses.lost = self.gear_losses.jammed;
            out.fill(f64::NAN);
        }
        if self.gear_losses.undefined.is_some() {
            out.fill(f64::NAN);
        }
        if !self.places.power_of_holding.is_empty() || !self.places.power_of_accelerations.is_empty() {
            let holding = self.holding.iter().copied().zip(self.active_torque.iter().copied());
            out[self.size - 2] += self.prescribed_work(&self.acceleration, holding.chain(self.gear_losses.losses()));
        }
    }

    /// The work of constraints that prescribe speeds for changes of speeds and impulses in directions, J; for
    /// accelerations and torques its power.
    pub(super) fn prescribed_work(&self, change: &[f64], impulses: impl Iterator<Item = (usize, f64)>) -> f64 {
        if self.places.power_of_accelerations.is_empty() && self.places.power_of_holding.is_empty() {
            return 0.0;
        }
        let of = |place: usize| self.work.more(&self.dynamics, place);
        let first = self.places.power_of_accelerations.start;
        let accelerations: f64 = change.iter().enumerate().map(|(i, change)| of(first + i) * change).sum();
        let first = self.places.power_of_holding.start;
        accelerations + impulses.map(|(k, impulse)| of(first + k) * impulse).sum::<f64>()
    }

    /// The friction torques at the point that was evaluated last.
    pub fn find_friction_torques(&mut self) {
        for (k, mode) in self.modes.iter().enumerate() {
            self.friction_torques[k] = match k.checked_sub(self.unilaterals.first) {
                Some(unilateral) => self.work.more(&self.dynamics, self.places.unilateral_torques.start + unilateral),
                None => {
                    let speed = self.dynamics.friction_speed(k, &self.work);
                    mode.sign() * self.dynamics.sliding_torque(k, speed)
                }
            };
        }
        for (k, torque) in self.gear_losses.losses() {
            self.friction_torques[k] = torque;
        }
        for (jenkins, &k) in self.jenkins.directions.iter().enumerate().filter(|(_, k)| self.modes[**k] == Mode::Stick)
        {
            self.friction_torques[k] = self.jenkins_torque(jenkins);
        }
        for a in 0..self.holding.len() {
            self.friction_torques[self.holding[a]] = self.active_torque[a];
        }
        if !self.following.is_empty() {
            self.split_friction();
        }
    }

    /// The value that is not finite at a state, as text, with the operation that caused it.
    pub fn not_finite(&mut self, time: f64, state: &[f64]) -> Option<String> {
        let regular = self.forces(time, state);
        self.gear_losses.undefined = None;
        let mut from = self.dynamics.plan().plan.not_finite(self.work.values());
        let mut what = self.value_not_finite(regular);
        if let Some((direction, operation)) = self.gear_losses.explain() {
            (from, what) = (operation, Some(format!("the `loss` of `{}` is NaN", self.names[direction])));
        }
        let what = what?;
        Some(from.map_or(what.clone(), |from| format!("{what}, as {from}")))
    }

    /// The same at the point whose forces were computed last, without the operation.
    fn value_not_finite(&mut self, regular: bool) -> Option<String> {
        let (r, shafts) = (self.degrees_of_freedom, &self.shaft_names);
        let find = |values: &[f64]| values.iter().position(|value| !value.is_finite());
        let kinematics = &self.work.kinematics;
        let name = |k: usize| &shafts[kinematics.coordinate_shaft(k)];
        let motions = [(&kinematics.angles, "angle"), (&kinematics.speeds, "speed")];
        for (values, what) in motions {
            if let Some(shaft) = find(values) {
                return Some(format!("the {what} of {} is {}", shafts[shaft], values[shaft]));
            }
        }
        let drives = [(&self.commands, "command"), (&self.applied, "torque")];
        for (values, what) in drives {
            if let Some(input) = find(values) {
                return Some(format!("the {what} of {} is {}", self.drives[input].name, values[input]));
            }
        }
        if let Some(what) = self.unilateral_not_finite() {
            return Some(what);
        }
        let sliding = |k: &usize| !self.work.more(&self.dynamics, self.places.friction_speeds.start + k).is_finite();
        if let Some(k) = (0..self.modes.len()).find(sliding) {
            return Some(format!("the sliding speed of friction {} is not finite", self.names[k]));
        }
        if let Some(k) = find(&self.force) {
            return Some(format!("the force on {} is {}", name(k), self.force[k]));
        }
        if !regular {
            return Some("the inertia is singular".into());
        }
        self.accelerate();
        let k = find(&self.acceleration[..r])?;
        let shaft = self.work.kinematics.coordinate_shaft(k);
        Some(format!("the acceleration of {} is {}", self.shaft_names[shaft], self.acceleration[k]))
    }

    /// Pairs of numbers whose products add up to the power of the inputs, and to that of the viscous loss, W, at the point last evaluated.
    pub fn power_factors(&self) -> [Vec<[f64; 2]>; 2] {
        let input = |k: usize| [self.applied[k], self.dynamics.input_speed(k, &self.work)];
        let damper = |k: usize| self.dynamics.damper_factors(k, &self.work);
        [(0..self.applied.len()).map(input).collect(), (0..self.dynamics.damper_count()).map(damper).collect()]
    }

    /// Whether no term depends on time until the segment ends: all sources are constant, and sampled laws keep their
    /// torques.
    pub fn is_steady(&self) -> bool {
        self.lines.iter().all(|(_, slope, _)| *slope == 0.0) && self.timed.is_steady()
    }

    /// Evaluates forces and accelerations in the present modes.
    pub fn evaluate(&mut self, time: f64, state: &[f64]) {
        self.forces(time, state);
        self.accelerate();
    }

    /// Kinetic and potential energy at a time and a state, J.
    pub fn energy(&mut self, time: f64, state: &[f64]) -> f64 {
        self.give_time(time, state);
        self.update(state);
        self.dynamics.energy(&self.work)
    }
}
