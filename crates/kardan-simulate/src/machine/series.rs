//! The series of a machine: its part that uses evaluations.

use std::ops::Range;

use super::Machine;
use super::expansion::{ByPosition, Expansion, Holding, Prospect, Watch};
use super::expressions::Places;
use super::torque_distribution;
use super::unilateral_kinds::Kind;
use crate::friction::NOISE;
use kardan_expr::plan::PiecedSeries;
use kardan_mechanics::reduce::MotionPlan;

/// The limit of a direction without one, as a multiple of the largest torque of all.
const MORE: f64 = 10.0;

impl Machine {
    /// See there.
    pub(super) fn by_position(&self) -> ByPosition {
        let (r, m) = (self.degrees_of_freedom, self.multiplier_constraints.end);
        let MotionPlan { plan, inertia, friction_rows, friction_bias, .. } = self.dynamics.plan();
        let mut rows = vec![Vec::new(); m];
        friction_rows.iter().for_each(|(entry, output)| rows[entry / r].push((entry % r, plan.place(*output))));
        let mut bias = vec![None; m];
        friction_bias.iter().for_each(|(k, output)| bias[*k] = Some(plan.place(*output)));
        let inertia = inertia.iter().map(|(entry, output)| (entry / r, entry % r, plan.place(*output))).collect();
        ByPosition { inertia, rows, bias }
    }

    /// The indices of outputs of the loop in the memory of the plan.
    pub(super) fn memory_places(&self, outputs: &Range<usize>) -> Vec<usize> {
        let MotionPlan { plan, more, .. } = self.dynamics.plan();
        outputs.clone().map(|output| plan.place(more.start + output)).collect()
    }

    /// Whether an input of the plan is constant within a step.
    pub(super) fn is_steady_input(&self, input: usize) -> bool {
        let Places { zoh_output, couplings, run_parameters, follows_signal, .. } = &self.places;
        let own = input.wrapping_sub(2 * self.degrees_of_freedom);
        // Behind the commands are limits, modes and senses.
        let of_modes = zoh_output.start..couplings.end;
        [&of_modes, run_parameters, follows_signal].into_iter().any(|places| places.contains(&own))
    }

    /// Prepares series up to an order, also of the angles and of the speeds of some shafts; false where a law computes
    /// by itself at every instant, or gears have losses.
    pub fn prepare_series(&mut self, order: usize, shafts: &[Vec<usize>; 2]) -> bool {
        let (r, m) = (self.degrees_of_freedom, self.multiplier_constraints.end);
        let MotionPlan { plan, angles, speeds, inertia, friction_rows, friction_bias, .. } = self.dynamics.plan();
        let steady = |input: usize| self.is_steady_input(input);
        let Places { forces, rates, powers, friction_speeds, commands, jenkins_torques, unilaterals, .. } =
            &self.places;
        let Places { power_of_accelerations, power_of_holding, .. } = &self.places;
        let prescribed = [power_of_accelerations, power_of_holding];
        let extended = [forces, rates, powers, friction_speeds, commands, jenkins_torques, unilaterals];
        let found = |outputs: &Range<usize>| self.memory_places(outputs);
        let place = |(_, output): &(usize, usize)| plan.place(*output);
        let motion = [inertia, friction_rows, friction_bias].into_iter().flatten().map(place);
        let rows = [angles, speeds].into_iter().zip(shafts);
        let rows = rows.flat_map(|(list, shafts)| list.iter().filter(|(shaft, _)| shafts.contains(shaft)));
        let read: Vec<usize> = rows.map(place).collect();
        let outputs = extended.into_iter().chain(prescribed).flat_map(found).chain(motion);
        let outputs: Vec<usize> = outputs.chain(read.iter().copied()).collect();
        let able = !self.own_laws && self.gear_losses.is_empty();
        let series = able.then(|| PiecedSeries::new(plan, order, &outputs, steady));
        let row_length = order + 1;
        let expansion = series.map(|series| Expansion {
            series,
            accelerations: vec![0.0; r * row_length],
            torques: vec![0.0; m * row_length],
            counts: [r, m],
            by_position: self.by_position(),
            forces: found(forces),
            rates: [rates, powers].map(found).concat(),
            friction_speeds: found(friction_speeds),
            commands: found(commands),
            unilaterals: found(unilaterals),
            power: prescribed.map(found),
            jenkins: self.jenkins.directions.iter().copied().zip(found(jenkins_torques)).collect(),
            scratch: vec![0.0; row_length],
            rows_follow: !read.is_empty(),
            friction_bias: vec![0.0; m],
        });
        self.expansion = expansion.map(Box::new);
        self.prepare_resolution(&read);
        self.expansion.is_some()
    }

    /// Computes the coefficients of order k + 1 of all states from those up to k; `x` contains them order after order.
    /// Returns how much the machine has evaluated.
    pub fn expand(&mut self, time: f64, k: usize, x: &mut [f64]) -> u64 {
        let Some(mut expansion) = self.expansion.take() else { return self.evaluated };
        match k {
            0 => self.begin_expansion(time, &mut expansion, x),
            _ => self.next_coefficients(k, &mut expansion, x),
        }
        self.expansion = Some(expansion);
        self.evaluated
    }

    /// Whether within a step of that length from the last expansion, whose highest order was `order`, a direction
    /// leaves its mode or a motor reaches or leaves a limit: decided by the Bernstein coefficients of the series, with
    /// a margin above the truncation error of the series.
    pub fn prospect(&mut self, length: f64, order: usize) -> Prospect {
        if !self.turning.is_empty() {
            return Prospect::Unknown;
        }
        let Some(mut expansion) = self.expansion.take() else { return Prospect::Unknown };
        let r = self.degrees_of_freedom;
        let speeds = &self.work.values()[r..2 * r];
        let of_terms = |k: usize| NOISE * self.dynamics.friction_terms(k, speeds, &self.work);
        let noise = |k: usize| self.noise_of_slip(k).unwrap_or_else(|| of_terms(k));
        let watch =
            Watch { modes: &self.modes, holding: &self.holding, unilaterals: &self.unilaterals, bounds: self.bounds() };
        let prospect = expansion.prospect(&watch, noise, &self.drives, (length, order));
        let of_active = expansion.prospect_of_holding(&watch, (length, order));
        self.expansion = Some(expansion);
        if of_active == Prospect::Stays || self.following.is_empty() {
            return prospect.and(of_active);
        }
        // Dependent directions may take a part.
        if prospect != Prospect::Unknown && self.shares_for((length, order)) {
            prospect
        } else {
            prospect.and(of_active)
        }
    }

    /// Whether the sticking directions, which do not rotate, can certainly distribute the torques for this time.
    fn shares_for(&mut self, (length, order): (f64, usize)) -> bool {
        let Self { expansion: Some(expansion), holding, bounds, torque_distribution, work, unilaterals, .. } = self
        else {
            return false;
        };
        let Expansion { series, by_position, torques, counts, .. } = &**expansion;
        let keeps = |place: usize| series.of(place).take(order).skip(1).all(|x| x == 0.0);
        let turns = |k: &usize| by_position.rows[*k].iter().any(|(_, place)| !keeps(*place));
        let uneven = |k: &usize| bounds[0][*k] != bounds[1][*k];
        if self.moves
            || !self.gear_losses.is_empty()
            || torque_distribution.sticking.iter().any(|k| turns(k) || uneven(k))
        {
            return false;
        }
        // A direction without a limit may take more than all others.
        let most = bounds[0].iter().chain(&torques[..holding.len()]).filter(|x| x.is_finite());
        let most = MORE * most.fold(0.0, |most: f64, x| most.max(x.abs()));
        let sizes: Vec<f64> = bounds[0].iter().map(|bound| if bound.is_finite() { *bound } else { most }).collect();
        let own =
            torque_distribution::Holding { directions: holding, weighted: &self.weighted, factor: &self.active_factor };
        torque_distribution.prepare(&own, &work.friction_rows, &sizes);
        self.torque_distribution_unique = false;
        let term = |k: usize, a: usize| torques[k * counts[1] + a];
        let limit = |direction: usize, k: usize| match direction.checked_sub(unilaterals.first) {
            Some(unilateral) if let Some(Kind::Friction { at_rest }) = unilaterals.kinds.get(unilateral) => {
                at_rest * series.value(expansion.unilaterals[2 * unilateral], k)
            }
            _ if k == 0 => bounds[0][direction],
            _ => 0.0,
        };
        torque_distribution.stays(holding.len(), &sizes, (length, order), term, limit)
    }

    /// Where an operation with kinks changes to another of its pieces, within a step of that length from the last
    /// expansion whose highest order was `order`, as a part of the length for which the deciding numbers are known, to
    /// a part of them: returned.
    pub fn kink(&mut self, (length, order): (f64, usize), part: f64) -> (Prospect, f64) {
        let Some(expansion) = &mut self.expansion else { return (Prospect::Stays, length) };
        expansion.kink((length, order), part)
    }

    /// Whether a value jumps right where the last expansion begins.
    pub fn begins_with_jump(&self) -> bool {
        self.expansion.as_ref().is_some_and(|expansion| expansion.series.jump())
    }

    /// Whether an operation in its series has kinks.
    pub fn has_kinks(&self) -> bool {
        self.expansion.as_ref().is_some_and(|expansion| expansion.series.margins().next().is_some())
    }

    /// The difference of the values that the modes depend on, at the point last evaluated, from their series at this
    /// time after the last expansion, in parts of their terms.
    pub fn difference_of_series(&mut self, later: f64, order: usize) -> f64 {
        let Some(expansion) = self.expansion.take() else { return 0.0 };
        let watch =
            Watch { modes: &self.modes, holding: &self.holding, unilaterals: &self.unilaterals, bounds: self.bounds() };
        let found = expansion.difference(&watch, &self.drives, self.work.values(), &self.active_torque, (later, order));
        self.expansion = Some(expansion);
        found
    }

    /// Whether modes may depend on a quantity that no state depends on: on the time, or on expressions of their own.
    pub fn is_blind(&self) -> bool {
        let switches = |kind: &Kind| matches!(kind, Kind::Lock | Kind::Friction { .. });
        !self.modes.is_empty() && (self.timed.moves() || self.unilaterals.kinds.iter().any(switches))
    }

    /// The indices of the series of angle and speed of a shaft; `None` where the plan does not compute them.
    pub fn shaft_series(&self, shaft: usize) -> Option<[usize; 2]> {
        let r = self.degrees_of_freedom;
        let MotionPlan { plan, angles, speeds, .. } = self.dynamics.plan();
        if self.has_massless {
            return None;
        }
        if let Some(k) = self.work.kinematics.coordinate(shaft) {
            return Some([k, r + k]);
        }
        let found =
            |list: &[(usize, usize)]| list.iter().find(|(k, _)| *k == shaft).map(|(_, output)| plan.place(*output));
        Some([found(angles)?, found(speeds)?])
    }

    /// Computes the coefficients of the highest order, whose states `x` contains, of all values too.
    pub fn complete_series(&mut self, order: usize, x: &[f64]) {
        let states = self.size - 2;
        if let Some(expansion) = &mut self.expansion {
            expansion.series.set(0, order, &x[order * self.size..][..states]);
            if expansion.rows_follow {
                expansion.series.advance(order);
            }
        }
    }

    /// The value of a series at a time after the last expansion.
    pub fn series_at(&self, place: usize, order: usize, later: f64) -> f64 {
        let Some(expansion) = &self.expansion else { return f64::NAN };
        expansion.series.of(place).take(order + 1).rev().fold(0.0, |sum, coefficient| sum * later + coefficient)
    }

    fn begin_expansion(&mut self, time: f64, expansion: &mut Expansion, x: &mut [f64]) {
        let (state, slope) = x.split_at_mut(self.size);
        self.derivative(time, state, &mut slope[..self.size]);
        expansion.series.begin(self.work.values());
        let first = 2 * self.degrees_of_freedom + self.places.sources.start;
        for (source, (_, slope, _)) in self.lines.iter().enumerate() {
            expansion.series.set(first + source, 1, &[*slope]);
        }
        let first = 2 * self.degrees_of_freedom + self.places.timed.start;
        for (k, coefficients) in self.timed.series(time).enumerate() {
            for (order, coefficient) in (1..=expansion.series.order()).zip(coefficients) {
                expansion.series.set(first + k, order, &[coefficient]);
            }
        }
        expansion.friction_bias.copy_from_slice(&self.work.friction_bias);
        if let Some(response) = self.response.as_mut().filter(|response| !response.valid) {
            let count = self.holding.len();
            let weighted = &self.weighted[..count * self.degrees_of_freedom];
            response.find(&self.work.factor, weighted, &self.active_factor, &self.still);
            response.valid = self.dynamics.has_constant_inertia() && self.active_constant;
        }
        expansion.store(0, &self.acceleration, &self.active_torque);
    }

    fn next_coefficients(&mut self, k: usize, expansion: &mut Expansion, x: &mut [f64]) {
        let (r, size, per) = (self.degrees_of_freedom, self.size, 1.0 / (k + 1) as f64);
        let (computed, next) = x.split_at_mut((k + 1) * size);
        let (now, next) = (&computed[k * size..], &mut next[..size]);
        expansion.series.set(0, k, &now[..size - 2]);
        expansion.series.advance(k);
        let holding = Holding { directions: &self.holding, bias: &mut self.work.friction_bias };
        expansion.forces(k, holding, &mut self.force);
        let (acceleration, torques) = match &mut self.response {
            Some(response) => {
                let bias = self.holding.iter().map(|&direction| self.work.friction_bias[direction]);
                let [acceleration, torques] = response.apply(&self.force, bias);
                (acceleration, torques)
            }
            None => {
                self.accelerate_constrained();
                (&self.acceleration[..], &self.active_torque[..])
            }
        };
        expansion.store(k, acceleration, torques);
        for i in 0..r {
            next[i] = now[r + i] * per;
            next[r + i] = acceleration[i] * per;
        }
        for &i in &self.still {
            next[i] = 0.0;
        }
        for (next, place) in next[2 * r..].iter_mut().zip(&expansion.rates) {
            *next = expansion.series.value(*place, k) * per;
        }
        if !expansion.power[0].is_empty() {
            next[size - 2] += expansion.prescribed_power(k, &self.holding) * per;
        }
        for &direction in &self.holding {
            self.work.friction_bias[direction] = expansion.friction_bias[direction];
        }
    }
}
