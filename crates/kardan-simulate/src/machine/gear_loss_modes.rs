//! Mode selection of gears at rest, alone and with the frictions that they share torques with.

use super::Machine;
use super::gear_losses::GearLosses;
use crate::friction::Mode;
use kardan_math::num::bracket;

/// Most iterations of torques and modes until they agree.
const MOST_ROUNDS: usize = 40;
/// Change of shared torques between two iterations, relative to the largest, that counts as none.
const SETTLED: f64 = 1e-11;
/// The rounding error of an acceleration, relative to its terms.
const ROUNDING: f64 = 1e-9;

impl Machine {
    /// [`Machine::decide`] where the limits of gears depend on the decision: iterates over modes and the resulting gear
    /// loads, until they agree.
    pub(super) fn decide_loaded(&mut self, resting: &[usize]) -> Vec<Mode> {
        let at_rest = vec![Mode::Stick; resting.len()];
        self.set_modes(resting, &at_rest);
        self.load_gears();
        let mut found = at_rest.clone();
        let mut tried: Vec<Vec<Mode>> = Vec::new();
        // Gears that would self-lock harder than their load pushes have no limit.
        let mut locked: Vec<usize> = Vec::new();
        for _ in 0..MOST_ROUNDS {
            // Modes for the present limits; gears tried in vain stay at rest where they would reverse.
            for bounds in &mut self.bounds {
                locked.iter().for_each(|k| bounds[*k] = f64::INFINITY);
            }
            let at = self.decide_with_bounds(resting);
            if tried.contains(&at) {
                break;
            }
            found.clone_from(&at);
            let fits = self.try_modes(resting, &at);
            let locks = self.gear_losses.jammed.filter(|k| resting.contains(k) && !locked.contains(k));
            if fits && locks.is_none() {
                break;
            }
            locked.extend(locks);
            for (&k, mode) in resting.iter().zip(&mut found) {
                if !self.goes(k) {
                    *mode = Mode::Stick;
                }
            }
            tried.push(at);
            // The torques of other sliding gears are fixed here; those of these gears are part of the decision.
            for gear in 0..self.gear_losses.directions.len() {
                let direction = self.gear_losses.directions[gear];
                if resting.contains(&direction) {
                    let torque = std::mem::take(&mut self.gear_losses.torques[gear]);
                    self.act(direction, torque);
                }
            }
            self.set_modes(resting, &at_rest);
        }
        self.set_modes(resting, &at_rest);
        self.load_gears();
        found
    }

    /// The sticking directions, where some depend on others, and torques of which each is the same part of its limit at
    /// the resulting gear loads; `None` where that part exceeds one.
    pub(super) fn shared_torques(&mut self) -> Option<(Vec<usize>, Vec<f64>)> {
        let sticking: Vec<usize> = self.holding.iter().chain(&self.following).copied().collect();
        let Some(groups) = self.groups(&sticking) else { return self.shared_by_box(sticking) };
        let (torques, part) = self.share_in_groups((&groups, 0.0), &sticking)?;
        (part <= 1.0 + ROUNDING).then_some((sticking, torques))
    }

    /// The margin of the sticking directions beside gears, where some depend on others, as a part of their limits;
    /// infinite where directions depend on several others, which only the convex problem decides.
    pub(super) fn shared_room(&mut self) -> f64 {
        self.factor_holding();
        let sticking: Vec<usize> = self.holding.iter().chain(&self.following).copied().collect();
        let groups = self.groups(&sticking);
        // A torque of rounding size does not load a unilateral constraint.
        let noise = self.torque_noise();
        let shared = groups.and_then(|groups| self.share_in_groups((&groups, noise), &sticking));
        // Far beyond the limit the value is not needed.
        shared.map_or(f64::INFINITY, |(_, part)| (1.0 - part).max(-1.0))
    }

    /// Torques of directions that stick in groups, and the largest part of its limit that one of them uses; `None`
    /// where the iteration does not converge. Groups that need no more than `noise` need no torque.
    fn share_in_groups(
        &mut self,
        (groups, noise): (&[Vec<(usize, f64)>], f64),
        sticking: &[usize],
    ) -> Option<(Vec<f64>, f64)> {
        let mut torques = vec![0.0; sticking.len()];
        let mut gear_losses = std::mem::take(&mut self.gear_losses);
        let mut found = None;
        for _ in 0..MOST_ROUNDS {
            let before = torques.clone();
            let mut most = 0.0f64;
            for (group, needed) in groups.iter().zip(&self.active_torque) {
                let needed = if needed.abs() <= noise { 0.0 } else { *needed };
                most = most.max(self.share_group(&mut gear_losses, group, needed, (sticking, &mut torques)));
            }
            self.read_loads_of(&mut gear_losses, sticking.iter().copied().zip(torques.iter().copied()));
            self.bound_gear_losses(&mut gear_losses);
            // The torques of other gears of a group are those of the previous round.
            let size = torques.iter().fold(0.0f64, |most, torque| most.max(torque.abs()));
            if before.iter().zip(&torques).all(|(before, now)| (before - now).abs() <= SETTLED * size) {
                found = Some(most);
                break;
            }
        }
        self.gear_losses = gear_losses;
        found.map(|part| (torques, part))
    }

    /// The same where directions depend on several others: torques of the convex problem, iterated with the resulting
    /// gear loads.
    fn shared_by_box(&mut self, sticking: Vec<usize>) -> Option<(Vec<usize>, Vec<f64>)> {
        for _ in 0..MOST_ROUNDS {
            let (accelerations, torques) = self.solve_box(&sticking);
            if accelerations.iter().any(|x| *x != 0.0) {
                return None;
            }
            let mut gear_losses = std::mem::take(&mut self.gear_losses);
            self.read_loads_of(&mut gear_losses, sticking.iter().copied().zip(torques.iter().copied()));
            self.bound_gear_losses(&mut gear_losses);
            self.gear_losses = gear_losses;
            let bounds = self.bounds();
            let is_bounded = |(&k, torque): (&usize, &f64)| torque.abs() <= bounds.of(k, *torque) * (1.0 + ROUNDING);
            if sticking.iter().zip(&torques).all(is_bounded) {
                return Some((sticking, torques));
            }
        }
        None
    }

    /// The sticking directions that are multiples of each independent one, as indices among them with their factors;
    /// `None` where one depends on several.
    fn groups(&self, sticking: &[usize]) -> Option<Vec<Vec<(usize, f64)>>> {
        let count = self.holding.len();
        let mut groups: Vec<Vec<(usize, f64)>> = (0..count).map(|a| vec![(a, 1.0)]).collect();
        for place in count..sticking.len() {
            let shares = self.shares_of_holding(sticking[place]);
            let largest = shares.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            let mut own = (0..count).filter(|&a| shares[a].abs() > ROUNDING * largest);
            match (own.next(), own.next()) {
                (Some(a), None) => groups[a].push((place, shares[a])),
                (None, _) => {}
                _ => return None,
            }
        }
        Some(groups)
    }

    /// Distributes the torque of a group; returns the part of its limits that this is.
    ///
    /// With a common part ρ of each limit and `Σ c T = Q`, the torque of the gear T is the one unknown: ρ follows from
    /// it, its load is affine in it, and `T − ρ f` changes its sign between none of Q and all of it.
    fn share_group(
        &self,
        gear_losses: &mut GearLosses,
        group: &[(usize, f64)],
        needed: f64,
        (sticking, torques): (&[usize], &mut [f64]),
    ) -> f64 {
        let most = |(place, factor): &(usize, f64)| {
            let bounds = &self.bounds[usize::from(factor * needed < 0.0)];
            bounds[sticking[*place]]
        };
        group.iter().for_each(|(place, _)| torques[*place] = 0.0);
        if let Some((place, factor)) = group.iter().find(|one| most(one) == f64::INFINITY) {
            torques[*place] = needed / factor;
            return 0.0;
        }
        let teeth = group.iter().find(|(place, _)| gear_losses.directions.contains(&sticking[*place])).copied();
        let remaining: Vec<(usize, f64)> =
            group.iter().filter(|one| Some(one.0) != teeth.map(|t| t.0)).copied().collect();
        let room: f64 = remaining.iter().map(|one| one.1.abs() * most(one)).sum();
        let part = |of_teeth: f64, torques: &mut [f64]| {
            let missing_torque = needed - teeth.map_or(0.0, |(_, factor)| factor * of_teeth);
            let part = if missing_torque == 0.0 { 0.0 } else { missing_torque.abs() / room };
            for one in remaining.iter().filter(|one| most(one) > 0.0) {
                torques[one.0] = part * most(one) * (one.1 * missing_torque).signum();
            }
            part
        };
        let Some((place, factor)) = teeth else { return part(0.0, torques) };
        let gear = gear_losses.directions.iter().position(|k| *k == sticking[place]).unwrap_or(0);
        let (sense, whole) = ((factor * needed).signum(), (needed / factor).abs());
        // The part that the others use beside a torque of the gear, minus the part that the gear uses.
        let mut beside = |torque: f64| {
            torques[place] = sense * torque;
            let remaining = part(sense * torque, torques);
            self.read_loads_of(gear_losses, sticking.iter().copied().zip(torques.iter().copied()));
            gear_losses.evaluate(|_, load| load * sense <= 0.0);
            let most = gear_losses.losses[gear];
            if room == 0.0 { (torque / most, torque - most) } else { (remaining, torque - remaining * most) }
        };
        if room == 0.0 {
            // No other direction has a torque.
            return if whole == 0.0 { 0.0 } else { beside(whole).0 };
        }
        let [nothing, all] = [0.0, whole].map(|torque| (torque, beside(torque).1));
        let found = if nothing.1 < 0.0 && all.1 > 0.0 {
            bracket([nothing, all], f64::EPSILON * whole, |torque| beside(torque).1)[0]
        } else {
            0.0
        };
        beside(found).0
    }

    /// Modes of directions at rest, and which of them are active.
    fn set_modes(&mut self, resting: &[usize], modes: &[Mode]) {
        resting.iter().zip(modes).for_each(|(&k, mode)| self.modes[k] = *mode);
        let sticks = |(&k, mode): (&usize, &Mode)| (*mode == Mode::Stick).then_some(k);
        let sticking: Vec<usize> = resting.iter().zip(modes).filter_map(sticks).collect();
        self.choose_holding(&sticking);
    }

    /// Whether modes of directions at rest agree with the gear loads in them.
    fn try_modes(&mut self, resting: &[usize], modes: &[Mode]) -> bool {
        let sliding = |(k, mode): &(&usize, &Mode)| **mode != Mode::Stick && !self.gear_losses.directions.contains(k);
        let torque =
            |(&k, mode): (&usize, &Mode)| (k, mode.sign() * self.bounds[usize::from(*mode == Mode::Backward)][k]);
        let starting_friction: Vec<(usize, f64)> = resting.iter().zip(modes).filter(sliding).map(torque).collect();
        self.set_modes(resting, modes);
        starting_friction.iter().for_each(|&(k, torque)| self.act(k, -torque));
        self.gear_losses.starting_friction.clone_from(&starting_friction);
        self.load_gears();
        let fits = self.fits(resting);
        starting_friction.iter().for_each(|&(k, torque)| self.act(k, torque));
        self.gear_losses.starting_friction.clear();
        fits
    }

    /// Whether sticking directions stay within their limits, and leaving ones move as their mode says, in the modes
    /// last evaluated.
    fn fits(&mut self, resting: &[usize]) -> bool {
        let all_bounded = if self.following.is_empty() {
            let bounds = self.bounds();
            let is_bounded = |(&k, torque): (&usize, &f64)| torque.abs() <= bounds.of(k, *torque) * (1.0 + ROUNDING);
            self.holding.iter().zip(&self.active_torque).all(is_bounded)
        } else {
            self.shared_torques().is_some()
        };
        all_bounded && resting.iter().all(|k| self.goes(*k))
    }

    /// Whether a direction moves in the sense of its mode, in the modes last evaluated.
    fn goes(&self, k: usize) -> bool {
        let terms = || self.friction_row(k).iter().zip(&self.acceleration).map(|(x, a)| x * a);
        let size: f64 = terms().map(f64::abs).sum::<f64>() + self.work.friction_bias[k].abs();
        let sense = self.modes[k].sign();
        sense == 0.0 || sense * (terms().sum::<f64>() + self.work.friction_bias[k]) >= -ROUNDING * size
    }
}
