//! Which friction directions stick, which slip, and how.

use super::Machine;
use super::unilateral_kinds::{Kind, RestEvents};
use crate::friction::{Bounds, Mode, NOISE, OUTSIDE};
use kardan_math::num::dot;

/// Rounding error of an acceleration that should vanish, relative to the terms that cancel in it.
const ROUNDING: f64 = 1e-12;
/// Acceleration of a dependent direction, relative to its terms, above which it is not rounding.
const MOVED: f64 = 1e-9;
/// Part of the motion within the step that coming to rest may take away at the instant found; more means that
/// coefficients cancel, and the direction is not at rest. The rounding case is some units in the last place of the time
/// over the step, the other about 1.
const REMOVED_SHARE: f64 = 1e-3;

impl Machine {
    /// The next modes of the given directions, all at rest.
    ///
    /// A direction that depends on sticking ones sticks too, so that modes never contradict the kinematics.
    pub(super) fn decide(&mut self, resting: &[usize]) -> Vec<Mode> {
        if self.gear_losses.is_empty() { self.decide_with_bounds(resting) } else { self.decide_loaded(resting) }
    }

    /// The same with the present bounds.
    pub(super) fn decide_with_bounds(&mut self, resting: &[usize]) -> Vec<Mode> {
        let (accelerations, _) = self.solve_box(&self.with_multipliers(resting));
        let accelerations = &accelerations[self.multiplier_constraints.len()..];
        let mut modes: Vec<Mode> = accelerations.iter().copied().map(Mode::of).collect();
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

    /// The convex problem over the given directions, all at rest: their accelerations and torques.
    ///
    /// Needs `force` with the friction of all other directions.
    pub(super) fn solve_box(&mut self, directions: &[usize]) -> (Vec<f64>, Vec<f64>) {
        let m = directions.len();
        let mut free = self.force.clone();
        self.work.factor.solve(&mut free);
        let (_, w) = self.compliance(directions);
        let without_torques = |&k: &usize| dot(self.friction_row(k), &free) + self.work.friction_bias[k];
        let right: Vec<f64> = directions.iter().map(without_torques).collect();
        let cancels = |k: usize| {
            let terms = self.friction_row(k).iter().zip(&free).map(|(g, x)| (g * x).abs()).sum::<f64>();
            terms + self.work.friction_bias[k].abs()
        };
        let cancels: Vec<f64> = directions.iter().map(|&k| cancels(k)).collect();
        let [forward, backward]: [Vec<f64>; 2] =
            [0, 1].map(|sense| directions.iter().map(|&k| self.bounds[sense][k]).collect());
        let bounds = Bounds { forward: &forward, backward: &backward };
        let mut torques = vec![0.0; m];
        self.box_problem.solve(&w, &right, bounds, &mut torques);
        self.contradiction.extend(self.box_problem.unbounded().iter().map(|&a| directions[a]));
        let c: Vec<f64> = (0..m).map(|a| bounds.scale(a, torques[a])).collect();
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
        let mut weighted = vec![0.0; m * r];
        for (a, &k) in directions.iter().enumerate() {
            weighted[a * r..(a + 1) * r].copy_from_slice(self.friction_row(k));
            self.work.factor.solve(&mut weighted[a * r..(a + 1) * r]);
        }
        // Directions have few entries.
        let entries = |&k: &usize| {
            self.friction_row(k).iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect::<Vec<_>>()
        };
        let sparse: Vec<Vec<(usize, f64)>> = directions.iter().map(entries).collect();
        let row_dot = |weighted: &[f64], row: &[(usize, f64)]| row.iter().map(|(i, x)| weighted[*i] * x).sum::<f64>();
        let w = (0..m * m).map(|i| row_dot(&weighted[i / m * r..(i / m + 1) * r], &sparse[i % m])).collect();
        (weighted, w)
    }

    /// Whether the sticking directions exceed their limits at this point.
    pub fn breaks_away(&mut self, time: f64, state: &[f64]) -> bool {
        if self.holding.is_empty() && self.jenkins.directions.is_empty() && !self.unilaterals.has_locks {
            return false;
        }
        self.evaluate(time, state);
        self.leave_rest().is_some() || self.jenkins_slip() || self.lock_margins().any(|(_, margin)| margin < 0.0)
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
    /// change: the result of [`Self::select_modes`].
    pub(crate) fn keeps_modes(&mut self) -> bool {
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
        self.following.iter().any(|&k| {
            let (bias, row) = (self.work.friction_bias[k], self.friction_row(k));
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
        let coupling_terms = coupling_terms.map(|(w, (&k, &torque))| (w * bounds.scale(k, torque)).abs());
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

    /// Mode selection at a point, with the sources of the segment that begins there.
    ///
    /// `crossing` are slipping directions that have just come to rest; with `everything` all directions at rest are
    /// determined from their speeds (the beginning of a run). Speeds in directions at rest are set to zero by the
    /// smallest change in the metric of the inertia. Returns the events as text.
    pub fn select_modes(&mut self, time: f64, state: &mut [f64], crossing: &[usize], everything: bool) -> Vec<String> {
        let before = self.modes.clone();
        self.contradiction.clear();
        self.settle_drives(time, state, everything);
        let rest_events = self.meet(time, state, (crossing, everything));
        if !self.contradiction.is_empty() {
            return std::mem::take(&mut self.happened);
        }
        if !everything
            && !self.unilaterals.struck
            && rest_events.crossing.is_empty()
            && self.modes.iter().all(|mode| *mode != Mode::Stick)
        {
            // No direction is at rest or comes to rest.
            return std::mem::take(&mut self.happened);
        }
        self.choose_modes(time, state, rest_events, everything);
        self.leave_stops();
        let mut events = std::mem::take(&mut self.happened);
        if !everything {
            let changed =
                before.iter().zip(&self.modes).zip(&self.names).enumerate().filter(|(_, ((was, is), _))| was != is);
            let reported = changed.filter(|(k, _)| self.may_rest(*k) || !self.unilaterals.slips(*k));
            events.extend(reported.filter_map(|(k, ((_, is), name))| {
                Some(format!("{name} {}", self.unilaterals.describe_mode(k, *is)?))
            }));
        }
        events
    }

    /// The mode selection of [`Self::select_modes`], with the speeds that vanish in the modes.
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

    /// Whether a direction reverses because its coefficients cancel at this angle, while the drive continues to move:
    /// stopping it would remove motion, not the rounding of an instant. Needs the accelerations of the modes so far.
    pub(super) fn passes(&self, k: usize) -> bool {
        if self.is_carried(k) && self.multiplier_constraints.clone().any(|row| self.dynamics.friction_varies(row)) {
            return true;
        }
        if !self.dynamics.friction_varies(k) {
            return false;
        }
        let row = self.friction_row(k);
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
}
