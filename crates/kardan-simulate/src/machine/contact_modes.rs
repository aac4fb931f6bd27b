//! Unilateral and switched constraints: clutches, one-way clutches, stops, soft stops and locks, and the impacts of
//! rigid ones.
//!
//! In the convex problem of friction they are directions whose bounds differ with the sense of motion: a one-way clutch
//! and a closed stop oppose motion backward with any torque and motion forward with none, a lock opposes both with any.
//! A soft stop has a torque that follows from the state, and modes that switch it.
//!
//! Impact: speeds jump so that no contact still closes ([`impact`](crate::impact)), by the same convex
//! problem over impulses.

use super::Machine;
use super::unilateral_kinds::{InvalidBound, Kind, RestEvents};
use crate::friction::{Bounds, Mode, NOISE};
use crate::impact::{Contacts, Impact};

/// Rebounds slower than this end at rest, rad/s or m/s: a bouncing contact comes to rest in a finite time. So do
/// rebounds below the rounding error of the position.
const LEAST_REBOUND: f64 = 1e-12;

/// Rounding error of an energy that is neither lost nor gained, relative to the energies of the impulses.
const GAINED: f64 = 1e-12;

/// Rounding error of a zero torque, relative to the largest torque.
const ROUNDING: f64 = 1e-12;

impl Machine {
    /// The mode inputs at the point last evaluated: see
    /// [`UnilateralTerms::mode_inputs`](super::contact_expressions::UnilateralTerms::mode_inputs).
    fn mode_inputs(&self, unilateral: usize) -> [f64; 2] {
        let first = self.places.unilaterals.start + 2 * unilateral;
        [first, first + 1].map(|place| self.work.more(&self.dynamics, place))
    }

    /// Whether the formula of a unilateral constraint is undefined at the point last evaluated, or below minus `least`.
    fn invalid_formula(&self, unilateral: usize, least: f64) -> Option<InvalidBound> {
        match (self.unilaterals.kinds[unilateral], self.mode_inputs(unilateral)[0]) {
            (Kind::Friction { .. }, torque) if !torque.is_finite() => Some(InvalidBound::Undefined),
            (Kind::Friction { .. }, torque) if torque < -least => Some(InvalidBound::Negative),
            (Kind::Lock, engaged) if engaged.is_nan() => Some(InvalidBound::Undefined),
            _ => None,
        }
    }

    /// A direction whose formula is undefined at the point last evaluated, or below minus `least`.
    pub(crate) fn invalid_bound(&self, least: f64) -> Option<(usize, InvalidBound)> {
        let mut unilaterals = 0..self.unilaterals.kinds.len();
        unilaterals
            .find_map(|k| Some((self.unilaterals.first + k, self.invalid_formula(k, least)?)))
            .or_else(|| self.gear_losses.invalid_bound(least))
    }

    /// Whether frictions, gear losses or locks have formulas.
    pub(crate) fn has_formulas(&self) -> bool {
        self.unilaterals.changes || self.unilaterals.has_locks || !self.gear_losses.is_empty()
    }

    /// The formula of a unilateral constraint that is not finite at the point last evaluated, as text.
    pub(super) fn unilateral_not_finite(&self) -> Option<String> {
        let mut unilaterals = 0..self.unilaterals.kinds.len();
        let unilateral = unilaterals.find(|k| self.invalid_formula(*k, f64::INFINITY).is_some())?;
        let what = if self.unilaterals.kinds[unilateral] == Kind::Lock { "`engaged`" } else { "the torque" };
        let (name, value) = (&self.names[self.unilaterals.first + unilateral], self.mode_inputs(unilateral)[0]);
        Some(format!("{what} of `{name}` is {value}"))
    }

    /// Whether a direction is a gear loss.
    pub(crate) fn is_gear_loss(&self, direction: usize) -> bool {
        self.unilaterals.kind(direction) == Kind::GearLoss
    }

    /// The bounds of frictions with a torque formula, at the point last evaluated.
    pub(super) fn find_bounds(&mut self) {
        for unilateral in 0..self.unilaterals.kinds.len() {
            if let Kind::Friction { at_rest } = self.unilaterals.kinds[unilateral] {
                let most = (at_rest * self.mode_inputs(unilateral)[0]).max(0.0);
                let direction = self.unilaterals.first + unilateral;
                self.bounds.iter_mut().for_each(|bounds| bounds[direction] = most);
            }
        }
    }

    /// Whether a direction can come to rest or stay at rest at the point last evaluated: a friction without torque, a
    /// released clutch, slips at any speed.
    pub(super) fn may_rest(&self, direction: usize) -> bool {
        let released = direction >= self.unilaterals.first && self.bounds[0][direction] == 0.0;
        self.unilaterals.takes_part(direction)
            && !(released && matches!(self.unilaterals.kind(direction), Kind::Friction { .. }))
    }

    /// The largest torques of directions against motion.
    pub(super) fn bounds(&self) -> Bounds<'_> {
        Bounds { forward: &self.bounds[0], backward: &self.bounds[1] }
    }

    /// The margin of a constraint torque to its bounds, as a part of them where they are well above zero and constant:
    /// beside a bound that comes near zero such a part is a narrow peak that no sample finds.
    pub(super) fn room_of(&self, direction: usize, torque: f64) -> f64 {
        let [forward, backward] = [self.bounds[0][direction], self.bounds[1][direction]];
        if self.has_moving_bounds(direction) {
            return (forward - torque).min(backward + torque);
        }
        if self.is_even(direction) {
            return 1.0 - torque.abs() / forward;
        }
        let room = |most: f64, torque: f64| match most {
            most if most == f64::INFINITY => f64::INFINITY,
            0.0 => -torque,
            most => 1.0 - torque / most,
        };
        room(forward, torque).min(room(backward, -torque)).min(1.0)
    }

    /// Whether a formula gives the largest torque of a friction.
    fn has_moving_bounds(&self, direction: usize) -> bool {
        let unilateral = direction.checked_sub(self.unilaterals.first);
        let kind = unilateral.and_then(|unilateral| self.unilaterals.kinds.get(unilateral));
        matches!(kind, Some(Kind::Friction { .. }))
    }

    /// The rounding error of the margin of a direction at the point last evaluated: where that is a torque itself, the
    /// difference of those of all.
    pub(crate) fn room_noise(&self, direction: usize) -> f64 {
        let one_way = self.bounds.iter().any(|bounds| bounds[direction] == 0.0) || self.has_moving_bounds(direction);
        if !one_way || !self.holding.contains(&direction) {
            return 0.0;
        }
        self.torque_noise()
    }

    /// The rounding error of the torques of active constraints.
    pub(super) fn torque_noise(&self) -> f64 {
        let torques = self.active_torque[..self.holding.len()].iter().chain(&self.force);
        ROUNDING * torques.fold(0.0f64, |most, torque| most.max(torque.abs()))
    }

    /// Whether the bounds of a direction are the same both ways, and neither zero nor infinite.
    fn is_even(&self, direction: usize) -> bool {
        let forward = self.bounds[0][direction];
        forward == self.bounds[1][direction] && forward > 0.0 && forward.is_finite()
    }

    /// Whether those of all sticking directions are.
    pub(crate) fn shares_by_size(&self) -> bool {
        self.holding.iter().chain(&self.following).all(|&k| self.is_even(k))
    }

    /// Gap and speed of a stop or soft stop from angles and speeds alone.
    fn gap(&self, direction: usize, offset: f64) -> [f64; 2] {
        let gap = self.dynamics.friction_angle(direction, &self.work) - offset;
        [gap, self.dynamics.friction_speed(direction, &self.work)]
    }

    /// Gap of a soft stop, and its contact torque if closed.
    fn push(&self, direction: usize, (offset, stiffness, damping): (f64, f64, f64)) -> [f64; 2] {
        let [gap, speed] = self.gap(direction, offset);
        [gap, -(stiffness * gap + damping * speed)]
    }

    /// The rounding error of a gap.
    fn gap_noise(&self, direction: usize, offset: f64) -> f64 {
        NOISE * (offset.abs() + self.dynamics.friction_angles(direction, &self.work))
    }

    /// The distance of a direction from leaving the mode that angles and speeds determine.
    pub(crate) fn slip_margin(&self, direction: usize) -> f64 {
        match (self.unilaterals.kind(direction), self.modes[direction]) {
            (Kind::Friction { .. } | Kind::OneWay | Kind::GearLoss, Mode::Stick) | (Kind::Lock, _) => f64::INFINITY,
            (Kind::Friction { .. } | Kind::OneWay | Kind::GearLoss, mode) => {
                mode.sign() * self.dynamics.friction_speed(direction, &self.work)
            }
            (Kind::Stop { .. }, _) if self.unilaterals.takes_part(direction) => f64::INFINITY,
            (Kind::Stop { offset, .. }, _) => self.gap(direction, offset)[0],
            (Kind::Cushion { offset, stiffness, damping }, mode) => {
                let [gap, push] = self.push(direction, (offset, stiffness, damping));
                match mode {
                    Mode::Stick => gap,
                    Mode::Forward => push,
                    Mode::Backward => (-gap).min(-push),
                }
            }
        }
    }

    /// Whether a direction is an open stop or soft stop; its margin is its gap.
    pub(crate) fn is_apart(&self, direction: usize) -> bool {
        match self.unilaterals.kind(direction) {
            Kind::Stop { .. } => !self.unilaterals.takes_part(direction),
            Kind::Cushion { .. } => self.modes[direction] == Mode::Stick,
            _ => false,
        }
    }

    /// The sign with which a direction slides, zero where it sticks; `None` where it has no torque: a lock or stop that
    /// is open, a clutch without torque.
    pub(crate) fn sign_of(&self, direction: usize) -> Option<f64> {
        let acts = self.bounds.iter().any(|bound| bound[direction] != 0.0);
        (self.unilaterals.takes_part(direction) && acts).then(|| self.modes[direction].sign())
    }

    /// Whether a stop closes, or a soft stop closes, is compressed again or opens, at the angles and speeds last
    /// evaluated.
    pub(super) fn contact_changes(&self, direction: usize) -> bool {
        match self.unilaterals.kind(direction) {
            Kind::Stop { offset, .. } if !self.unilaterals.takes_part(direction) => {
                let [gap, speed] = self.gap(direction, offset);
                gap < 0.0 && speed < -NOISE * self.dynamics.friction_terms(direction, &self.step_speeds, &self.work)
            }
            Kind::Cushion { offset, .. } if self.modes[direction] == Mode::Stick => {
                let [gap, speed] = self.gap(direction, offset);
                gap < 0.0 && speed < 0.0
            }
            Kind::Cushion { .. } => self.slip_margin(direction) < 0.0,
            _ => false,
        }
    }

    /// The distance of a lock from switching at the point last evaluated.
    fn lock_margin(&self, unilateral: usize) -> f64 {
        let above = self.mode_inputs(unilateral)[0] - 0.5;
        if self.unilaterals.engaged[unilateral] { above } else { -above }
    }

    /// The same of all locks.
    pub(super) fn lock_margins(&self) -> impl Iterator<Item = (usize, f64)> {
        let locks = self.unilaterals.kinds.iter().enumerate().filter(|(_, kind)| **kind == Kind::Lock);
        locks.map(|(unilateral, _)| (self.unilaterals.first + unilateral, self.lock_margin(unilateral)))
    }

    /// Soft stops and locks at the point last evaluated.
    fn switch_unilaterals(&mut self, everything: bool) {
        for unilateral in 0..self.unilaterals.kinds.len() {
            let direction = self.unilaterals.first + unilateral;
            let before = (self.modes[direction], self.unilaterals.engaged[unilateral]);
            match self.unilaterals.kinds[unilateral] {
                Kind::Lock => {
                    if self.lock_margin(unilateral) < 0.0 || everything {
                        self.unilaterals.engaged[unilateral] = self.mode_inputs(unilateral)[0] > 0.5;
                    }
                    if !self.unilaterals.engaged[unilateral] {
                        self.modes[direction] = Mode::Forward;
                    }
                }
                Kind::Cushion { offset, stiffness, damping } => {
                    // The numbers that decided it, to the last bit.
                    let [gap, push] = self.push(direction, (offset, stiffness, damping));
                    self.modes[direction] = match (gap < 0.0, push > 0.0) {
                        (true, true) => Mode::Forward,
                        (true, false) => Mode::Backward,
                        (false, _) => Mode::Stick,
                    };
                }
                _ => continue,
            }
            let after = (self.modes[direction], self.unilaterals.engaged[unilateral]);
            if before == after {
                continue;
            }
            let what = match (self.unilaterals.kinds[unilateral], before.0, after.0) {
                _ if everything => continue,
                (Kind::Lock, ..) if after.1 => "engages",
                (Kind::Lock, ..) => "is released",
                (_, Mode::Stick, _) => "is touched",
                (_, _, Mode::Stick) if before.0 == Mode::Backward => continue,
                (_, Mode::Backward, _) => "is pressed again",
                _ => "is left",
            };
            self.happened.push(format!("{} {what}", self.names[direction]));
        }
    }

    /// Stops, locks and soft stops at the current state, and the impacts where rigid ones close with a speed. Returns
    /// which directions come to rest, and after an impact or at the begin all that are at rest.
    pub(super) fn meet(
        &mut self,
        time: f64,
        state: &mut [f64],
        (crossing, everything): (&[usize], bool),
    ) -> RestEvents {
        self.unilaterals.struck = false;
        if self.unilaterals.is_empty() {
            return RestEvents { crossing: crossing.to_vec(), resting: None };
        }
        self.evaluate(time, state);
        let arriving = |k: &&usize| matches!(self.unilaterals.kind(**k), Kind::Stop { .. });
        let mut arrived: Vec<usize> = crossing.iter().filter(arriving).copied().collect();
        let (engaged, mut released) = (self.unilaterals.engaged.clone(), false);
        self.switch_unilaterals(everything);
        for unilateral in 0..self.unilaterals.kinds.len() {
            let direction = self.unilaterals.first + unilateral;
            match self.unilaterals.kinds[unilateral] {
                Kind::Stop { offset, .. } if everything => {
                    self.unilaterals.engaged[unilateral] =
                        self.gap(direction, offset)[0] <= self.gap_noise(direction, offset);
                    self.modes[direction] = Mode::Forward;
                }
                Kind::Stop { .. } => self.unilaterals.engaged[unilateral] |= arrived.contains(&direction),
                Kind::Lock if self.unilaterals.engaged[unilateral] && !engaged[unilateral] => arrived.push(direction),
                Kind::Friction { .. } if self.modes[direction] == Mode::Stick && !self.may_rest(direction) => {
                    self.slip_with_speed(direction);
                    released = true;
                    if !everything {
                        self.happened.push(format!("{} is released", self.names[direction]));
                    }
                }
                _ => {}
            }
        }
        if released || engaged != self.unilaterals.engaged {
            self.activate_sticking();
        }
        let jammed = self.gear_losses.lost.filter(|direction| crossing.contains(direction));
        let resting = match arrived.is_empty() && !everything && jammed.is_none() {
            true => None,
            false => self.strike(time, state, (everything, jammed)),
        };
        arrived.extend(crossing.iter().filter(|k| self.unilaterals.slips(**k)));
        // A clutch that was released and is pressed again while it does not turn is at rest.
        let pressed = |k: &usize| {
            matches!(self.unilaterals.kind(*k), Kind::Friction { .. })
                && self.modes[*k] != Mode::Stick
                && self.may_rest(*k)
                && self.dynamics.friction_speed(*k, &self.work) == 0.0
        };
        let unilaterals = self.unilaterals.first..self.unilaterals.first + self.unilaterals.kinds.len();
        let pressed: Vec<usize> = unilaterals.filter(|k| !everything && !arrived.contains(k) && pressed(k)).collect();
        arrived.extend(pressed);
        RestEvents { crossing: arrived, resting }
    }

    /// The impact at the point last evaluated, if engaged rigid directions close with a speed that they block; with the
    /// directions that are at rest after it. Gears that jam are rigid; the caller reports them and the energy.
    fn strike(&mut self, time: f64, state: &mut [f64], (begins, jammed): (bool, Option<usize>)) -> Option<Vec<usize>> {
        let (r, first) = (self.degrees_of_freedom, self.unilaterals.first);
        let rigid = |unilateral: &usize| match self.unilaterals.kinds[*unilateral] {
            Kind::OneWay => true,
            Kind::Stop { .. } | Kind::Lock => self.unilaterals.engaged[*unilateral],
            Kind::GearLoss => jammed == Some(first + unilateral),
            Kind::Friction { .. } | Kind::Cushion { .. } => false,
        };
        let rigid: Vec<usize> =
            (0..self.unilaterals.kinds.len()).filter(rigid).map(|unilateral| first + unilateral).collect();
        let before: Vec<f64> = state[r..2 * r].to_vec();
        let sizes: Vec<f64> = before.iter().map(|speed| speed.abs()).collect();
        // The instant is known to the last bits of the time, and a speed to its change within these.
        let gains: Vec<f64> = self.acceleration.iter().map(|a| 4.0 * f64::EPSILON * time * a.abs()).collect();
        let noise = |this: &Self, k: usize, sizes: &[f64]| {
            let terms = |sizes: &[f64]| this.dynamics.friction_terms(k, sizes, &this.work);
            NOISE * terms(sizes) + terms(&gains)
        };
        let meets = |k: &usize| {
            let speed = self.dynamics.friction_speed(*k, &self.work);
            let both_ways = matches!(self.unilaterals.kind(*k), Kind::Lock | Kind::GearLoss);
            (if both_ways { speed.abs() } else { -speed }) > noise(self, *k, &sizes)
        };
        let hit: Vec<usize> = rigid.iter().copied().filter(meets).collect();
        if hit.is_empty() {
            return None;
        }
        // Multiplier constraints are included, though no contact closes there.
        let parts: Vec<usize> = self.multiplier_constraints.clone().chain(rigid.iter().copied()).collect();
        let (Impact { impulses, mut last, mut rebounds, .. }, lost, weighted) = self.solve_impact(&parts);
        if !self.contradiction.is_empty() {
            return None;
        }
        for (row, impulse) in weighted.chunks_exact(r.max(1)).zip(&impulses) {
            state[r..2 * r].iter_mut().zip(row).for_each(|(speed, x)| *speed -= x * impulse);
        }
        let change: Vec<f64> = before.iter().zip(&state[r..2 * r]).map(|(before, after)| after - before).collect();
        state[self.size - 2] += self.prescribed_work(&change, parts.iter().copied().zip(impulses.iter().copied()));
        last.drain(..self.multiplier_constraints.len());
        rebounds.drain(..self.multiplier_constraints.len());
        let one = |k: &usize| {
            let speed = self.dynamics.friction_speed(*k, &self.work).abs();
            format!("{} meets {speed:.6} {}", self.names[*k], self.unilaterals.units[*k - first])
        };
        if jammed.is_none() {
            state[self.size - 1] += lost;
            let what: Vec<String> = hit.iter().map(one).collect();
            self.happened.push(format!("{}: the impact dissipates {lost:.6} J", what.join(", ")));
        }
        self.unilaterals.struck = true;
        let component = |k: &usize| self.dynamics.friction_component(*k, &change, &self.work).abs();
        let passed =
            self.gear_losses.directions.iter().filter(|k| jammed.is_none() && component(k) > noise(self, **k, &sizes));
        self.unilaterals.passed = passed.copied().collect();
        // Directions that it has stopped are at rest; so are those with a rounding speed, and those at rest before that
        // were not moved.
        let stopped = rigid.iter().zip(&rebounds).zip(&last);
        let stopped: Vec<usize> =
            stopped.filter(|((_, e), impulse)| **e == 0.0 && **impulse != 0.0).map(|((k, _), _)| *k).collect();
        let sizes: Vec<f64> = sizes.iter().zip(&state[r..2 * r]).map(|(a, b)| a.max(b.abs())).collect();
        self.step_speeds.copy_from_slice(&sizes);
        let rests = |k: &usize| {
            let noise = noise(self, *k, &sizes);
            let component = |x: &[f64]| self.dynamics.friction_component(*k, x, &self.work);
            let rested = !begins && self.modes[*k] == Mode::Stick && component(&change).abs() <= noise;
            let speed = match self.moving[*k] {
                true => self.dynamics.friction_speed(*k, &self.work) + component(&change),
                false => component(&state[r..2 * r]),
            };
            self.may_rest(*k) && (stopped.contains(k) || rested || speed.abs() <= noise)
        };
        Some(self.directions.iter().copied().filter(rests).collect())
    }

    /// The least rebound speeds at which each stop opens by more than the rounding error of its position, at the forces
    /// last evaluated; of other directions none.
    fn least_rebounds(&mut self, rigid: &[usize]) -> Vec<f64> {
        let mut free = self.force.clone();
        self.work.factor.solve(&mut free);
        // A force may act on it through active constraints: then it returns as fast with that.
        self.accelerate();
        let least = |&k: &usize| {
            let Some(Kind::Stop { offset, .. }) = self.unilateral_of(k) else { return 0.0 };
            let component =
                |x: &[f64]| (self.dynamics.friction_component(k, x, &self.work) + self.work.friction_bias[k]).abs();
            let acceleration = component(&free).max(component(&self.acceleration));
            LEAST_REBOUND.max((2.0 * acceleration * self.gap_noise(k, offset)).sqrt())
        };
        rigid.iter().map(least).collect()
    }

    /// The kind of a direction that is not a multiplier constraint.
    fn unilateral_of(&self, direction: usize) -> Option<Kind> {
        (!self.multiplier_constraints.contains(&direction)).then(|| self.unilaterals.kind(direction))
    }

    /// The impulses of multiplier constraints and rigid directions at the point last evaluated, so that no contact
    /// still closes and no energy is gained; with the energy lost, J, and H⁻¹ of each direction.
    fn solve_impact(&mut self, rigid: &[usize]) -> (Impact, f64, Vec<f64>) {
        let speed = |&k: &usize| {
            if self.multiplier_constraints.contains(&k) { 0.0 } else { self.dynamics.friction_speed(k, &self.work) }
        };
        let before: Vec<f64> = rigid.iter().map(speed).collect();
        let least = self.least_rebounds(rigid);
        let restitution_of = |&k: &usize| match self.unilateral_of(k) {
            Some(Kind::Stop { restitution, .. }) => restitution,
            _ => 0.0,
        };
        let mut restitution: Vec<f64> = rigid.iter().map(restitution_of).collect();
        let struck = |a: &usize| -restitution[*a] * before[*a] > least[*a];
        let mut dulled: Vec<usize> = Vec::new();
        if !self.unilaterals.rebounds {
            dulled.extend((0..rigid.len()).filter(struck).map(|a| rigid[a]));
            restitution.fill(0.0);
        }
        let (weighted, w) = self.compliance(rigid);
        // Gears that jam have any impulse.
        let jams = |k: usize| self.unilateral_of(k) == Some(Kind::GearLoss);
        let most = |bounds: &Vec<f64>| rigid.iter().map(|&k| if jams(k) { f64::INFINITY } else { bounds[k] }).collect();
        let [mut forward, backward]: [Vec<f64>; 2] = self.bounds.each_ref().map(most);
        loop {
            let bounds = Bounds { forward: &forward, backward: &backward };
            let contacts = Contacts { w: &w, restitution: &restitution, least: &least, bounds };
            let impact = contacts.collide(&mut self.box_problem, &before);
            let after = |a: usize| contacts.after(&before, &impact.impulses, a).0;
            let (lost, size) = contacts.lost(&before, &impact.impulses);
            // The projection never gains.
            if !(lost >= -GAINED * size) && restitution.iter().any(|e| *e != 0.0) {
                dulled.extend(
                    (0..rigid.len()).filter(|a| impact.impulses[*a] != 0.0 && restitution[*a] > 0.0).map(|a| rigid[a]),
                );
                restitution.fill(0.0);
                continue;
            }
            // A stop that opens only by rounding, from the impact at another one, would have another impact, and so on.
            let stays = |a: &usize| forward[*a] == 0.0 && least[*a] > 0.0 && after(*a) > 0.0 && after(*a) <= least[*a];
            let Some(a) = (0..rigid.len()).find(stays) else {
                self.contradiction.extend(self.box_problem.unbounded().iter().map(|&a| rigid[a]));
                if impact.cut_short {
                    dulled.extend(impact.shared.iter().map(|a| rigid[*a]));
                } else {
                    self.unilaterals.shared.extend(impact.shared.iter().map(|a| rigid[*a]));
                }
                self.unilaterals.dulled.extend(dulled);
                return (impact, lost.max(0.0), weighted);
            };
            forward[a] = f64::INFINITY;
            restitution[a] = 0.0;
        }
    }

    /// Stops that are no longer at rest open.
    pub(super) fn leave_stops(&mut self) {
        for unilateral in 0..self.unilaterals.kinds.len() {
            if matches!(self.unilaterals.kinds[unilateral], Kind::Stop { .. }) {
                self.unilaterals.engaged[unilateral] = self.modes[self.unilaterals.first + unilateral] == Mode::Stick;
            }
        }
    }

    /// The first stop that the motion begins beyond, with the penetration, rad.
    pub(crate) fn beyond_stop(&mut self, time: f64, state: &[f64]) -> Option<(usize, f64)> {
        self.give_time(time, state);
        self.update(state);
        let beyond = |unilateral: usize| {
            let Kind::Stop { offset, .. } = self.unilaterals.kinds[unilateral] else { return None };
            let direction = self.unilaterals.first + unilateral;
            let [gap, _] = self.gap(direction, offset);
            (gap < -self.gap_noise(direction, offset)).then_some((direction, -gap))
        };
        (0..self.unilaterals.kinds.len()).find_map(beyond)
    }

    /// The unit of angles of a unilateral constraint.
    pub(crate) fn unit_of_direction(&self, direction: usize) -> &'static str {
        self.unilaterals.units[direction - self.unilaterals.first].trim_end_matches("/s")
    }

    /// Whether a direction is a friction, and not a clutch, a stop or a lock.
    pub(crate) fn is_friction(&self, direction: usize) -> bool {
        direction < self.unilaterals.first
    }

    /// Whether controllers act.
    pub(crate) fn has_laws(&self) -> bool {
        !self.laws.is_empty()
    }

    /// Contacts that shared an impulse with restitution, and those whose restitution was left out, since the last call.
    pub(crate) fn take_shared(&mut self) -> [Vec<usize>; 2] {
        [&mut self.unilaterals.shared, &mut self.unilaterals.dulled].map(|list| {
            let mut list = std::mem::take(list);
            list.sort_unstable();
            list.dedup();
            list
        })
    }
}
