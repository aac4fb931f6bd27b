//! Which friction directions stick, which slip, and how.

use super::Machine;
use super::torque_distribution::{Holding, TorqueDistribution};
use super::unilateral_kinds::{Kind, RestEvents};
use crate::num::{Cholesky, dot};
use crate::simulate::friction::{Bounds, Mode, NOISE, OUTSIDE, Span};

/// Rounding error of an acceleration that should vanish, relative to the terms that cancel in it.
const ROUNDING: f64 = 1e-12;
/// Acceleration of a dependent direction, relative to its terms, above which it is not rounding.
const MOVED: f64 = 1e-9;
/// Part of the motion within the step that coming to rest may take away at the instant found; more means that
/// coefficients cancel, and the direction is not at rest. The rounding case is some units in the last place of the time
/// over the step, the other about 1.
const REMOVED_SHARE: f64 = 1e-3;
/// Part of a direction outside the multiplier constraints, squared, that counts as none: the square of the accuracy of
/// an event's position.
const VANISHED: f64 = 1e-12;

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
    fn share_active(&mut self, most: f64) -> bool {
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
        if !(self.active_constant && self.torque_distribution_known && !self.unilaterals.changes) {
            let holding = Holding { directions: &self.holding, weighted: &self.weighted, factor: &self.active_factor };
            self.torque_distribution.prepare(&holding, &self.work.friction_rows, c);
            self.torque_distribution_known = true;
        }
        true
    }

    /// The next modes of the given directions, all at rest.
    ///
    /// A direction that depends on sticking ones sticks too, so that modes never contradict the kinematics.
    pub(super) fn decide(&mut self, resting: &[usize]) -> Vec<Mode> {
        if self.gear_losses.is_empty() { self.decide_with_bounds(resting) } else { self.decide_loaded(resting) }
    }

    /// The same with the present bounds.
    pub(super) fn decide_with_bounds(&mut self, resting: &[usize]) -> Vec<Mode> {
        let (accelerations, _) = self.solve_box(&self.with_multipliers(resting));
        let mut modes: Vec<Mode> = accelerations[self.multiplier_constraints.len()..]
            .iter()
            .map(|acceleration| match acceleration {
                a if *a > 0.0 => Mode::Forward,
                a if *a < 0.0 => Mode::Backward,
                _ => Mode::Stick,
            })
            .collect();
        // Where none depends on the others, every accelerating direction slips.
        let dependent = self.multiplier_constraints.len() + resting.len() > self.holding.len();
        if dependent && modes.contains(&Mode::Stick) && modes.iter().any(|mode| *mode != Mode::Stick) {
            let sticking = resting.iter().zip(&modes).filter(|(_, mode)| **mode == Mode::Stick).map(|(&k, _)| k);
            let mut sticking_rows = self.with_multipliers(&sticking.collect::<Vec<_>>());
            sticking_rows.retain(|&k| !self.moving[k]);
            let span = self.span(&sticking_rows);
            for (&k, mode) in resting.iter().zip(&mut modes) {
                let depends = || span.rejected(self.metric_row(k)) <= OUTSIDE && !self.is_carried(k);
                if *mode != Mode::Stick && !self.moving[k] && depends() {
                    *mode = Mode::Stick;
                }
            }
        }
        modes
    }

    /// Multiplier constraints, which are always active, and other directions.
    fn with_multipliers(&self, further: &[usize]) -> Vec<usize> {
        self.multiplier_constraints.clone().chain(further.iter().copied()).collect()
    }

    /// The convex problem over the given directions, all at rest: their accelerations and torques.
    ///
    /// Needs `force` with the friction of all other directions.
    pub(super) fn solve_box(&mut self, directions: &[usize]) -> (Vec<f64>, Vec<f64>) {
        let (r, m) = (self.degrees_of_freedom, directions.len());
        let mut free = self.force.clone();
        self.work.factor.solve(&mut free);
        let (_, w) = self.compliance(directions);
        let row = |k: usize| &self.work.friction_rows[k * r..(k + 1) * r];
        let right: Vec<f64> = directions.iter().map(|&k| dot(row(k), &free) + self.work.friction_bias[k]).collect();
        let cancels = |k: usize| {
            let terms = row(k).iter().zip(&free).map(|(g, x)| (g * x).abs()).sum::<f64>();
            terms + self.work.friction_bias[k].abs()
        };
        let cancels: Vec<f64> = directions.iter().map(|&k| cancels(k)).collect();
        let [forward, backward]: [Vec<f64>; 2] =
            [0, 1].map(|sense| directions.iter().map(|&k| self.bounds[sense][k]).collect());
        let bounds = Bounds { forward: &forward, backward: &backward };
        let mut torques = vec![0.0; m];
        self.box_problem.solve(&w, &right, bounds, &mut torques);
        self.contradiction.extend(self.box_problem.unbounded().iter().map(|&a| directions[a]));
        // Directions without a bound are scaled by their torque.
        let c: Vec<f64> = (0..m)
            .map(|a| {
                let most = forward[a].max(backward[a]);
                if most.is_finite() { most } else { torques[a].abs() }
            })
            .collect();
        let accelerations = (0..m)
            .map(|a| {
                let row = &w[a * m..(a + 1) * m];
                let acceleration = right[a] - dot(row, &torques);
                let scale: f64 = cancels[a] + row.iter().zip(&c).map(|(w, c)| (w * c).abs()).sum::<f64>();
                let noise = ROUNDING * scale;
                let at_bound = torques[a] * acceleration.signum() >= bounds.of(a, acceleration) * (1.0 - 1e-9);
                if at_bound && acceleration.abs() > noise { acceleration } else { 0.0 }
            })
            .collect();
        (accelerations, torques)
    }

    /// `H⁻¹ Gᵀ` row by row, and `W = G H⁻¹ Gᵀ`, over the directions given.
    pub(super) fn compliance(&self, directions: &[usize]) -> (Vec<f64>, Vec<f64>) {
        let (r, m) = (self.degrees_of_freedom, directions.len());
        let row = |k: usize| &self.work.friction_rows[k * r..(k + 1) * r];
        let mut weighted = vec![0.0; m * r];
        for (a, &k) in directions.iter().enumerate() {
            weighted[a * r..(a + 1) * r].copy_from_slice(row(k));
            self.work.factor.solve(&mut weighted[a * r..(a + 1) * r]);
        }
        // Directions have few entries.
        let entries = |&k: &usize| row(k).iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect::<Vec<_>>();
        let sparse: Vec<Vec<(usize, f64)>> = directions.iter().map(entries).collect();
        let row_dot = |weighted: &[f64], row: &[(usize, f64)]| row.iter().map(|(i, x)| weighted[*i] * x).sum::<f64>();
        let w = (0..m * m).map(|i| row_dot(&weighted[i / m * r..(i / m + 1) * r], &sparse[i % m])).collect();
        (weighted, w)
    }

    /// Whether any direction is active that [`Machine::breaks_away`] evaluates.
    pub fn may_break_away(&self) -> bool {
        !(self.holding.is_empty() && self.jenkins.directions.is_empty() && !self.unilaterals.has_locks)
    }

    /// Whether the sticking directions exceed their limits at this point.
    pub fn breaks_away(&mut self, time: f64, state: &[f64]) -> bool {
        if !self.may_break_away() {
            return false;
        }
        self.evaluate(time, state);
        self.leave_rest().is_some() || self.any_jenkins_slips() || self.a_lock_turns()
    }

    /// The next modes of the directions at rest at the point last evaluated, if they do not all stay at rest. The same
    /// function decides the search for an event and the event itself, so both agree to the last bit.
    fn leave_rest(&mut self) -> Option<Vec<(usize, Mode)>> {
        let bounds = self.bounds();
        if self.holding.iter().zip(&self.active_torque).all(|(&k, torque)| bounds.contains(k, *torque)) {
            return if self.moves_on() { self.leaving() } else { None };
        }
        if !self.following.is_empty() && self.share_active(1.0 - 1e-12) {
            // Torques within their bounds that balance all forces: there is no acceleration.
            return None;
        }
        if !self.gear_losses.is_empty() && !self.following.is_empty() && self.shared_torques().is_some() {
            return None;
        }
        if self.following.is_empty()
            && self.gear_losses.is_empty()
            && let Some(leaving) = self.one_leaves()
        {
            return leaving.map(|leaving| vec![leaving]);
        }
        self.leaving()
    }

    /// Whether all modes stay the same with the new commands and sources, at the point last evaluated, where only these
    /// change: the result of [`Self::settle`].
    pub(in crate::simulate) fn keeps_modes(&mut self) -> bool {
        self.contradiction.clear();
        let mut drives = self.drives.iter().zip(&self.commands);
        drives.all(|(drive, command)| drive.limit_mode == drive.limit_mode(*command)) && self.leave_rest().is_none()
    }

    /// The next modes of the directions at rest by the convex problem, if they do not all stay at rest.
    fn leaving(&mut self) -> Option<Vec<(usize, Mode)>> {
        let resting = self.sticking();
        let modes = self.decide(&resting);
        modes.iter().any(|mode| *mode != Mode::Stick).then(|| resting.into_iter().zip(modes).collect())
    }

    /// Whether a prescribed speed moves a direction that depends on the active ones.
    fn moves_on(&self) -> bool {
        let r = self.degrees_of_freedom;
        self.following.iter().any(|&k| {
            let (bias, row) = (self.work.friction_bias[k], &self.work.friction_rows[k * r..(k + 1) * r]);
            let terms = || row.iter().zip(&self.acceleration).map(|(g, a)| g * a);
            let size = bias.abs() + terms().map(f64::abs).sum::<f64>();
            (bias + terms().sum::<f64>()).abs() > MOVED * size
        })
    }

    /// Which of the active directions, independent of each other, does not stay at rest at the point last evaluated, if
    /// at most one does not: with its torque at its limit all others stick, which solves the convex problem. `None`
    /// where more than one may leave.
    ///
    /// Method: with `W = G H⁻¹ Gᵀ`, `W t = b` the constraint torques and `W z = e_a`, the torques `t − α z` leave
    /// direction a the acceleration α and the others none.
    fn one_leaves(&mut self) -> Option<Option<(usize, Mode)>> {
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        let bounds = Bounds { forward: &self.bounds[0], backward: &self.bounds[1] };
        let within_bounds = |(k, torque): (&usize, &f64)| bounds.contains(*k, *torque);
        let mut beyond = (0..count).filter(|&a| !within_bounds((&self.holding[a], &self.active_torque[a])));
        let Some(a) = beyond.next() else { return Some(None) };
        if beyond.next().is_some() {
            return None;
        }
        let (k, torque) = (self.holding[a], self.active_torque[a]);
        let most = bounds.of(k, torque);
        let z = &mut self.scratch[..count];
        z.fill(0.0);
        z[a] = 1.0;
        self.active_factor.solve(z);
        let acceleration = (torque.abs() - most) / z[a];
        let mut free = self.force.clone();
        self.work.factor.solve(&mut free);
        let row = &self.work.friction_rows[k * r..(k + 1) * r];
        let terms: f64 = row.iter().zip(&free).map(|(g, x)| (g * x).abs()).sum();
        let coupling_terms =
            self.active_matrix[a * count..(a + 1) * count].iter().zip(self.holding.iter().zip(&self.active_torque));
        // Directions without a bound are scaled by their torque.
        let size = |k: usize, torque: f64| {
            let most = bounds.forward[k].max(bounds.backward[k]);
            if most.is_finite() { most } else { torque.abs() }
        };
        let coupling_terms = coupling_terms.map(|(w, (&k, &torque))| (w * size(k, torque)).abs());
        let scale = terms + self.work.friction_bias[k].abs() + coupling_terms.sum::<f64>();
        if !acceleration.is_finite() || z[a] <= 0.0 {
            return None;
        }
        if acceleration <= ROUNDING * scale {
            return Some(None);
        }
        let change = acceleration * torque.signum();
        let mut candidates =
            (0..count).filter(|&b| b != a).map(|b| (&self.holding[b], self.active_torque[b] - change * z[b]));
        candidates
            .all(|(k, torque)| within_bounds((k, &torque)))
            .then_some(Some((k, if torque > 0.0 { Mode::Forward } else { Mode::Backward })))
    }

    /// Uses the integrator step between two states as the scale of events in it; `length` (s) is that of the step
    /// before it was shortened for an event.
    pub fn measure_step(&mut self, length: f64, from: &[f64], to: &[f64]) {
        let speeds = self.degrees_of_freedom..2 * self.degrees_of_freedom;
        self.step_length = length;
        for ((size, a), b) in self.step_speeds.iter_mut().zip(&from[speeds.clone()]).zip(&to[speeds]) {
            *size = a.abs().max(b.abs());
        }
    }

    /// Whether there is friction at all.
    pub fn has_friction(&self) -> bool {
        !self.modes.is_empty()
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
        self.give_prescribed(time, state);
        let r = self.degrees_of_freedom;
        self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
        self.slip_margin(direction)
    }

    /// The distance of the sticking directions from their limits at a state, as a part of those: negative beyond. Where
    /// they share torques, with the torques of least norm, which is less than the largest possible margin.
    pub fn active_reserve(&mut self, time: f64, state: &[f64]) -> f64 {
        self.evaluate(time, state);
        self.active_reserve_here()
    }

    /// [`Self::active_reserve`] at the point last evaluated.
    pub fn active_reserve_here(&mut self) -> f64 {
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

    pub(in crate::simulate) fn slip_margin(&self, direction: usize) -> f64 {
        if direction >= self.unilaterals.first {
            return self.unilateral_margin(direction);
        }
        match self.modes[direction] {
            Mode::Stick => f64::INFINITY,
            mode => mode.sign() * self.dynamics.friction_speed(direction, &self.work),
        }
    }

    /// Slipping directions whose speed has the wrong sign at this time and point of the step, beyond rounding.
    pub fn reversed(&mut self, time: f64, state: &[f64], out: &mut Vec<usize>) {
        out.clear();
        let r = self.degrees_of_freedom;
        let turns = self.may_turn();
        if self.unilaterals.is_empty() && !turns && !self.modes.iter().any(|mode| *mode != Mode::Stick) {
            return;
        }
        self.give_prescribed(time, state);
        self.dynamics.update_shafts(&state[..r], &state[r..2 * r], &mut self.work);
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
        if turns {
            out.extend(self.carried_along());
        }
    }

    /// Whether multiplier constraints may rotate away from directions that depend on them alone.
    pub(super) fn may_turn(&self) -> bool {
        !self.turning.is_empty()
    }

    /// Directions that depended on multiplier constraints alone until these rotated, and that now have a speed beyond
    /// rounding at the point last evaluated.
    fn carried_along(&self) -> Vec<usize> {
        let moves = |k: &usize| self.dynamics.friction_speed(*k, &self.work).abs() > self.noise_of_rows(*k);
        self.turning.iter().copied().filter(moves).collect()
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

    /// Mode selection at a point, with the sources of the segment that begins there.
    ///
    /// `crossing` are slipping directions that have just come to rest; with `everything` all directions at rest are
    /// determined from their speeds (the beginning of a run). Speeds in directions at rest are set to zero by the
    /// smallest change in the metric of the inertia. Returns the events as text.
    pub fn settle(
        &mut self,
        time: f64,
        state: &mut [f64],
        crossing: &[usize],
        everything: bool,
        names: &[String],
        input_names: &[String],
    ) -> Vec<String> {
        let before = self.modes.clone();
        let mut events = Vec::new();
        self.contradiction.clear();
        self.settle_drives(time, state, everything, input_names, &mut events);
        let rest_events = self.meet(time, state, (crossing, everything), names, &mut events);
        if !self.contradiction.is_empty() {
            return events;
        }
        if !everything
            && !self.unilaterals.struck
            && rest_events.crossing.is_empty()
            && self.modes.iter().all(|mode| *mode != Mode::Stick)
        {
            // No direction is at rest or comes to rest.
            return events;
        }
        self.choose_modes(time, state, rest_events, everything);
        self.leave_stops();
        if !everything {
            let changed = before.iter().zip(&self.modes).zip(names).enumerate().filter(|(_, ((was, is), _))| was != is);
            let reported = changed.filter(|(k, _)| self.may_rest(*k) || !self.unilaterals.slips(*k));
            events.extend(reported.filter_map(|(k, ((_, is), name))| {
                Some(format!("{name} {}", self.unilaterals.describe_mode(k, *is)?))
            }));
        }
        events
    }

    /// The mode selection of [`Self::settle`], with the speeds that vanish in the modes.
    fn choose_modes(
        &mut self,
        time: f64,
        state: &mut [f64],
        RestEvents { crossing, resting }: RestEvents,
        everything: bool,
    ) {
        self.evaluate(time, state);
        if self.decide_jenkins_modes(&crossing, everything) {
            self.evaluate(time, state);
        }
        let crossing: Vec<usize> = crossing.into_iter().filter(|k| !self.jenkins.directions.contains(k)).collect();
        if !everything && crossing.is_empty() && resting.is_none() {
            if let Some(modes) = self.leave_rest() {
                self.stop_along_holding(state);
                modes.into_iter().for_each(|(k, mode)| self.modes[k] = mode);
                self.activate_sticking();
            }
            return;
        }
        let (passing, crossing): (Vec<usize>, Vec<usize>) =
            crossing.iter().partition(|&&k| !self.may_rest(k) || self.passes(k));
        for &k in &passing {
            self.slip_with_speed(k);
        }
        let mut resting: Vec<usize> = if everything || resting.is_some() {
            let resting = resting.unwrap_or_else(|| self.without_speed(state));
            (0..self.directions.len()).for_each(|k| self.slip_with_speed(self.directions[k]));
            resting
        } else {
            let rests = |k: &usize| self.modes[*k] == Mode::Stick || crossing.contains(k);
            self.directions.iter().copied().filter(rests).collect()
        };
        // Directions that depend on resting ones are at rest too.
        self.choose_holding(&resting);
        let may = |k: &usize| !resting.contains(k) && !passing.contains(k) && self.may_rest(*k) && !self.is_outside(*k);
        let mut dependent: Vec<usize> = self.directions.iter().copied().filter(may).collect();
        if !dependent.is_empty() {
            let span = self.span(&self.with_multipliers(&resting));
            dependent.retain(|&k| span.rejected(self.metric_row(k)) <= OUTSIDE);
            // A direction that multiplier constraints alone determine at this position need not be at rest.
            dependent.retain(|&k| !self.is_carried(k));
            if self.moves {
                // A direction that a prescribed speed moves is at rest only while that speed is zero.
                let rests = self.without_speed(state);
                dependent.retain(|k| rests.contains(k));
            }
        }
        let uncoupled = dependent.is_empty() && self.following.is_empty();
        resting.extend(dependent);
        resting.sort_unstable();
        self.stop_along_holding(state);
        for &k in &resting {
            self.modes[k] = Mode::Stick;
        }
        self.forces(time, state);
        let leaving = if uncoupled {
            self.accelerate();
            if self.gear_losses.is_empty() { self.one_leaves() } else { None }
        } else {
            None
        };
        match leaving {
            Some(leaving) => leaving.into_iter().for_each(|(k, mode)| self.modes[k] = mode),
            None => {
                let modes = self.decide(&resting);
                resting.iter().zip(modes).for_each(|(&k, mode)| self.modes[k] = mode);
            }
        }
        self.activate_sticking();
        // A direction at rest because others are has only a rounding speed.
        let r = self.degrees_of_freedom;
        self.still.iter().for_each(|&i| state[r + i] = 0.0);
    }

    pub(super) fn activate_sticking(&mut self) {
        let sticking = self.sticking();
        self.choose_holding(&sticking);
    }

    /// Directions that stick, except sliders.
    fn sticking(&self) -> Vec<usize> {
        self.directions.iter().copied().filter(|&k| self.modes[k] == Mode::Stick).collect()
    }

    /// A direction slips in the sense of its motion.
    pub(super) fn slip_with_speed(&mut self, k: usize) {
        let speed = self.dynamics.friction_speed(k, &self.work);
        let back = speed < 0.0 && matches!(self.unilaterals.kind(k), Kind::Friction { .. } | Kind::GearLoss);
        self.modes[k] = if back { Mode::Backward } else { Mode::Forward };
    }

    /// Directions whose speed is only rounding.
    fn without_speed(&self, state: &[f64]) -> Vec<usize> {
        let speeds = &state[self.degrees_of_freedom..2 * self.degrees_of_freedom];
        let rests = |k: &usize| {
            let speed = self.dynamics.friction_speed(*k, &self.work).abs();
            self.may_rest(*k) && speed <= NOISE * self.dynamics.friction_terms(*k, speeds, &self.work)
        };
        self.directions.iter().copied().filter(rests).collect()
    }

    /// Speeds in the active directions become zero: `v −= H⁻¹Gᵀ (G H⁻¹Gᵀ)⁻¹ G v`.
    fn stop_along_holding(&mut self, state: &mut [f64]) {
        let r = self.degrees_of_freedom;
        self.factor_holding();
        let count = self.holding.len();
        let component = |&k: &usize| match k.checked_sub(self.multiplier_constraints.start) {
            Some(row) => self.work.more(&self.dynamics, self.places.multiplier_speeds.start + row),
            None if self.moving[k] => self.dynamics.friction_speed(k, &self.work),
            None => dot(&self.work.friction_rows[k * r..(k + 1) * r], &state[r..2 * r]),
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

    /// Whether a direction reverses because its coefficients cancel at this angle, while the drive continues to move:
    /// stopping it would remove motion, not the rounding of an instant. Needs the accelerations of the modes so far.
    pub(super) fn passes(&self, k: usize) -> bool {
        if self.is_carried(k) && self.multiplier_constraints.clone().any(|row| self.dynamics.friction_varies(row)) {
            return true;
        }
        if !self.dynamics.friction_varies(k) {
            return false;
        }
        let r = self.degrees_of_freedom;
        let row = &self.work.friction_rows[k * r..(k + 1) * r];
        let mut change = row.to_vec();
        self.work.factor.solve(&mut change);
        let factor = self.dynamics.friction_speed(k, &self.work) / dot(row, &change);
        let (mut removed, mut expected_change) = (0.0, 0.0);
        for ((change, size), acceleration) in change.iter().zip(&self.step_speeds).zip(&self.acceleration) {
            let change = (factor * change).abs();
            removed += change * change;
            expected_change += change * (size + self.step_length * acceleration.abs());
        }
        removed > REMOVED_SHARE * expected_change || factor.is_nan()
    }

    /// Whether a direction depends on multiplier constraints alone at this position.
    fn is_carried(&self, k: usize) -> bool {
        !self.multiplier_constraints.is_empty()
            && self.span(&self.with_multipliers(&[])).rejected(self.metric_row(k)) <= VANISHED
    }

    /// Names of sticking directions whose torques are not unique.
    pub fn shared_friction(&self) -> Vec<usize> {
        if self.following.is_empty() {
            return Vec::new();
        }
        // A dependent direction shares torque with the active ones that it is a combination of; one in which no motion
        // is possible shares none.
        let (r, count) = (self.degrees_of_freedom, self.holding.len());
        let mut out = Vec::new();
        for &f in &self.following {
            let row = &self.work.friction_rows[f * r..(f + 1) * r];
            let mut shares: Vec<f64> = (0..count).map(|a| dot(&self.weighted[a * r..(a + 1) * r], row)).collect();
            self.active_factor.solve(&mut shares);
            let largest = shares.iter().fold(0.0f64, |max, x| max.max(x.abs()));
            let mut with = (0..count).filter(|&a| shares[a].abs() > 1e-9 * largest).map(|a| self.holding[a]);
            let with: Vec<usize> = with.by_ref().filter(|k| !self.multiplier_constraints.contains(k)).collect();
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

    /// A friction direction in the metric of the inverse inertia.
    pub(super) fn metric_row(&self, k: usize) -> Vec<f64> {
        let r = self.degrees_of_freedom;
        let mut row = self.work.friction_rows[k * r..(k + 1) * r].to_vec();
        self.work.factor.half_solve(&mut row);
        row
    }

    /// Whether a direction is certainly no combination of the active ones, whose factor is known: in the metric of the
    /// inverse inertia more than half of its square is outside of their span.
    fn is_outside(&self, k: usize) -> bool {
        let r = self.degrees_of_freedom;
        let row = &self.work.friction_rows[k * r..(k + 1) * r];
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
        (self.active_known, self.torque_distribution_known) = (false, false);
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
}
