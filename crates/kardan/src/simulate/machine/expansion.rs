//! The Taylor series of the motion in one set of modes, coefficient by coefficient.
//!
//! Everything but the accelerations follows from the expressions of the loop ([`Series`]). With `H(t) a(t) = f(t) − Gᵀ(t) λ(t)` the
//! coefficient k of the accelerations is what the same factors give for `f_k − Σ_j H_j a_(k−j) − Σ_j G_jᵀ λ_(k−j)` over j from 1, and
//! that of the torques that hold makes `Σ_j g_j a_(k−j)` and the bias vanish along each direction.

use super::Machine;
use super::expressions::Places;
use crate::plan::{Series, convolution};
use crate::reduce::MotionPlan;

/// Series of a machine, with memory of its own.
pub(super) struct Expansion {
    series: Series,
    stride: usize,
    /// Coefficients of the accelerations, and of the torques that hold, those of one after the other.
    accelerations: Vec<f64>,
    torques: Vec<f64>,
    /// Entries of each friction direction that depend on the position, with their places in the plan's memory; and its bias.
    rows: Vec<Vec<(usize, usize)>>,
    bias: Vec<Option<usize>>,
    /// Entries of the inertia that do: row, column, place.
    inertia: Vec<(usize, usize, usize)>,
    /// What is found: forces, rates, powers, speeds along friction directions, commands.
    forces: Vec<usize>,
    rates: Vec<usize>,
    friction_speeds: Vec<usize>,
    commands: Vec<usize>,
    state: Vec<f64>,
    slope: Vec<f64>,
    /// The bias at the point of expansion.
    friction_bias: Vec<f64>,
}

impl Machine {
    /// Prepares series up to an order; false where a law computes by itself at every instant, or something has kinks.
    pub fn prepare_series(&mut self, order: usize) -> bool {
        let (r, m) = (self.degrees_of_freedom, self.modes.len());
        let MotionPlan { plan, inertia, friction_rows, friction_bias, more, .. } = self.dynamics.plan();
        let Places { held, limits, follows, limiter_rates, senses, .. } = &self.places;
        let steady = |input: usize| {
            let given = input.wrapping_sub(2 * r);
            [held, limits, follows, limiter_rates, senses].into_iter().any(|places| places.contains(&given))
        };
        let series = if self.own_laws { None } else { Series::new(plan, order, steady) };
        let found = |places: &std::ops::Range<usize>| -> Vec<usize> {
            places.clone().map(|output| plan.place(more.start + output)).collect()
        };
        let mut rows = vec![Vec::new(); m];
        friction_rows.iter().for_each(|(entry, output)| rows[entry / r].push((entry % r, plan.place(*output))));
        let mut bias = vec![None; m];
        friction_bias.iter().for_each(|(k, output)| bias[*k] = Some(plan.place(*output)));
        let stride = order + 1;
        let expansion = series.map(|series| Expansion {
            stride,
            series,
            accelerations: vec![0.0; r * stride],
            torques: vec![0.0; m * stride],
            rows,
            bias,
            inertia: inertia.iter().map(|(entry, output)| (entry / r, entry % r, plan.place(*output))).collect(),
            forces: found(&self.places.forces),
            rates: found(&self.places.rates).into_iter().chain(found(&self.places.powers)).collect(),
            friction_speeds: found(&self.places.friction_speeds),
            commands: found(&self.places.commands),
            state: vec![0.0; self.size],
            slope: vec![0.0; self.size],
            friction_bias: vec![0.0; m],
        });
        self.expansion = expansion.map(Box::new);
        self.expansion.is_some()
    }

    /// Finds the coefficients of order k + 1 of all states from those up to k; `x` holds those of one state after the other, one more
    /// than the order for each.
    pub fn expand(&mut self, time: f64, k: usize, x: &mut [f64]) {
        let Some(mut expansion) = self.expansion.take() else { return };
        match k {
            0 => self.begin_expansion(time, &mut expansion, x),
            _ => self.next_coefficients(k, &mut expansion, x),
        }
        self.expansion = Some(expansion);
    }

    fn begin_expansion(&mut self, time: f64, expansion: &mut Expansion, x: &mut [f64]) {
        let stride = expansion.stride;
        expansion.state.iter_mut().zip(x.iter().step_by(stride)).for_each(|(state, x)| *state = *x);
        self.derivative(time, &expansion.state, &mut expansion.slope);
        x.iter_mut().skip(1).step_by(stride).zip(&expansion.slope).for_each(|(x, slope)| *x = *slope);
        expansion.series.begin(self.work.values());
        let first = 2 * self.degrees_of_freedom + self.places.sources.start;
        for (source, (_, slope, _)) in self.lines.iter().enumerate() {
            expansion.series.set(first + source, 1, *slope);
        }
        expansion.friction_bias.copy_from_slice(&self.work.friction_bias);
        expansion.keep(0, self);
    }

    fn next_coefficients(&mut self, k: usize, expansion: &mut Expansion, x: &mut [f64]) {
        let (r, stride, per) = (self.degrees_of_freedom, expansion.stride, 1.0 / (k + 1) as f64);
        for state in 0..self.size - 2 {
            expansion.series.set(state, k, x[state * stride + k]);
        }
        expansion.series.advance(k);
        expansion.forces(k, self);
        self.accelerate_held();
        expansion.keep(k, self);
        for i in 0..r {
            x[i * stride + k + 1] = x[(r + i) * stride + k] * per;
            x[(r + i) * stride + k + 1] = self.acceleration[i] * per;
        }
        for &i in &self.still {
            x[i * stride + k + 1] = 0.0;
        }
        for (state, place) in (2 * r..).zip(&expansion.rates) {
            x[state * stride + k + 1] = expansion.series.value(*place, k) * per;
        }
        self.work.friction_bias.copy_from_slice(&expansion.friction_bias);
    }
}

impl Expansion {
    /// Keeps the coefficients of order k of accelerations and torques.
    fn keep(&mut self, k: usize, machine: &Machine) {
        for (coefficients, value) in self.accelerations.chunks_exact_mut(self.stride).zip(&machine.acceleration) {
            coefficients[k] = *value;
        }
        for (coefficients, value) in self.torques.chunks_exact_mut(self.stride).zip(&machine.hold_torque) {
            coefficients[k] = *value;
        }
    }

    /// Puts the forces of order k, less what lower orders take of them, and the bias along the directions that hold.
    fn forces(&self, k: usize, machine: &mut Machine) {
        let Self { series, stride, accelerations, torques, .. } = self;
        let acceleration = |i: usize| &accelerations[i * stride..][..k];
        for (force, place) in machine.force.iter_mut().zip(&self.forces) {
            *force = series.value(*place, k);
        }
        for &(row, column, place) in &self.inertia {
            machine.force[row] -= convolution(&series.of(place)[1..=k], acceleration(column));
        }
        for (a, &direction) in machine.holding.iter().enumerate() {
            let torque = &torques[a * stride..][..k];
            let mut bias = self.bias[direction].map_or(0.0, |place| series.value(place, k));
            for &(i, place) in &self.rows[direction] {
                let entry = &series.of(place)[1..=k];
                machine.force[i] -= convolution(entry, torque);
                bias += convolution(entry, acceleration(i));
            }
            machine.work.friction_bias[direction] = bias;
        }
    }
}
