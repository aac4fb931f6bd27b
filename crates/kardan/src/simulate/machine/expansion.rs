//! The Taylor series of the motion in one set of modes, coefficient by coefficient.
//!
//! Everything but the accelerations follows from the expressions of the loop ([`Series`]). With `H(t) a(t) = f(t) − Gᵀ(t) λ(t)` the
//! coefficient k of the accelerations is what the same factors give for `f_k − Σ_j H_j a_(k−j) − Σ_j G_jᵀ λ_(k−j)` over j from 1, and
//! that of the torques that hold makes `Σ_j g_j a_(k−j)` and the bias vanish along each direction.

use super::Machine;
use super::expressions::Places;
use crate::plan::{Series, convolution};
use crate::reduce::MotionPlan;
use crate::simulate::drive::Limit;
use crate::simulate::friction::Mode;

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
    scratch: Vec<f64>,
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
            scratch: vec![0.0; stride],
            state: vec![0.0; self.size],
            slope: vec![0.0; self.size],
            friction_bias: vec![0.0; m],
        });
        self.expansion = expansion.map(Box::new);
        self.expansion.is_some()
    }

    /// Finds the coefficients of order k + 1 of all states from those up to k; `x` holds those of one state after the other, one more
    /// than the order for each. Tells how much the machine has evaluated.
    pub fn expand(&mut self, time: f64, k: usize, x: &mut [f64]) -> u64 {
        let Some(mut expansion) = self.expansion.take() else { return self.evaluated };
        match k {
            0 => self.begin_expansion(time, &mut expansion, x),
            _ => self.next_coefficients(k, &mut expansion, x),
        }
        self.expansion = Some(expansion);
        self.evaluated
    }

    /// A number that grows with each evaluation of the equations.
    pub fn evaluated(&self) -> u64 {
        self.evaluated
    }

    /// Whether within a step of that length from the last expansion, whose highest order was `order`, certainly no direction leaves its mode
    /// and no motor comes to a limit or leaves it: the series are positive by their Bernstein coefficients, with more room than what the
    /// series leave out. What is not certain may be so all the same.
    pub fn stays(&mut self, length: f64, order: usize) -> bool {
        let Some(mut expansion) = self.expansion.take() else { return false };
        let stays = expansion.stays(self, length, order);
        self.expansion = Some(expansion);
        stays
    }

    /// Where the series of angle and speed of a shaft are; `None` where they are not found by the plan.
    pub fn shaft_series(&self, shaft: usize) -> Option<[usize; 2]> {
        let r = self.degrees_of_freedom;
        let MotionPlan { plan, angles, speeds, .. } = self.dynamics.plan();
        if let Some(k) = self.work.kinematics.coordinate(shaft) {
            return Some([k, r + k]);
        }
        let found =
            |list: &[(usize, usize)]| list.iter().find(|(k, _)| *k == shaft).map(|(_, output)| plan.place(*output));
        Some([found(angles)?, found(speeds)?])
    }

    /// Finds the coefficients of the highest order, whose states `x` holds, of all values too.
    pub fn complete_series(&mut self, order: usize, x: &[f64]) {
        let states = self.size - 2;
        if let Some(expansion) = &mut self.expansion {
            let stride = expansion.stride;
            (0..states).for_each(|state| expansion.series.set(state, order, x[state * stride + order]));
            expansion.series.advance(order);
        }
    }

    /// The value of a series so long after the last expansion.
    pub fn series_at(&self, place: usize, order: usize, later: f64) -> f64 {
        let Some(expansion) = &self.expansion else { return f64::NAN };
        expansion.series.of(place)[..=order].iter().rev().fold(0.0, |sum, coefficient| sum * later + coefficient)
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

/// Part of a limit that is kept clear of it.
const CLEAR: f64 = 1e-9;

impl Expansion {
    fn stays(&mut self, machine: &Machine, length: f64, order: usize) -> bool {
        let Self { series, torques, stride, scratch, .. } = self;
        let mut positive = |coefficients: &[f64], sign: f64, limit: f64| {
            let terms = scratch.iter_mut().zip(&coefficients[..order]);
            let mut power = sign;
            terms.for_each(|(term, coefficient)| {
                *term = coefficient * power;
                power *= length;
            });
            scratch[0] += limit;
            is_positive(&mut scratch[..order])
        };
        let moving = machine.modes.iter().zip(&self.friction_speeds).filter(|(mode, _)| **mode != Mode::Stick);
        for (mode, place) in moving {
            if !positive(series.of(*place), mode.sign(), 0.0) {
                return false;
            }
        }
        let c = machine.dynamics.breakaway_torques();
        for (a, &k) in machine.holding.iter().enumerate() {
            let torque = &torques[a * *stride..][..*stride];
            let limit = c[k] * (1.0 - CLEAR);
            if !(positive(torque, 1.0, limit) && positive(torque, -1.0, limit)) {
                return false;
            }
        }
        for (drive, place) in machine.drives.iter().zip(&self.commands) {
            if drive.rate.is_some() || drive.limit_mode != Limit::Inside {
                return false;
            }
            let Some(limit) = drive.limit.map(|limit| limit * (1.0 - CLEAR)) else { continue };
            let command = series.of(*place);
            if !(positive(command, 1.0, limit) && positive(command, -1.0, limit)) {
                return false;
            }
        }
        true
    }

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

/// Whether `Σ c_k s^k` is certainly positive for 0 < s ≤ 1, with more than its last term to spare where it is not at its begin. The
/// coefficients become others.
fn is_positive(c: &mut [f64]) -> bool {
    let Some((first, rest)) = c.split_first() else { return false };
    let spare = rest.last().map_or(0.0, |last| last.abs());
    let sizes = rest.iter().fold(0.0, |sum, c| sum + c.abs());
    if !(*first >= 0.0) {
        return false;
    }
    if *first > sizes + spare {
        return true;
    }
    // Coefficients of Bernstein's polynomials: b_j = Σ_i (j over i)/(n over i) c_i.
    let n = c.len() - 1;
    let mut binomial = 1.0;
    for (i, c) in c.iter_mut().enumerate() {
        *c /= binomial;
        binomial *= (n - i) as f64 / (i + 1) as f64;
    }
    for i in 1..=n {
        for j in (i..=n).rev() {
            c[j] += c[j - 1];
        }
    }
    c.iter().skip(1).all(|b| *b > spare)
}

#[cfg(test)]
mod tests {
    use super::is_positive;

    #[test]
    fn positive_polynomials_are_told_and_others_never() {
        // (1 − s)² + 1/10, s(1 − s/2), 1: positive; each with a term that is left out next to nothing.
        for c in [vec![1.1, -2.0, 1.0, 0.0], vec![0.0, 1.0, -0.5, 0.0], vec![1.0, 0.0]] {
            assert!(is_positive(&mut c.clone()), "{c:?}");
        }
        // A zero inside, at the end, a negative begin, no number, and a double zero just above the axis that the last term may hide.
        for c in [
            vec![1.0, -3.0, 1.0, 0.0],
            vec![1.0, -1.0, 0.0],
            vec![-1e-30, 1.0, 0.0],
            vec![f64::NAN, 1.0, 0.0],
            vec![1.0, f64::NAN, 0.0],
            vec![0.2501, -1.0, 1.0, 1e-3],
        ] {
            assert!(!is_positive(&mut c.clone()), "{c:?}");
        }
        // Random ones against a fine grid: what is told to be positive is.
        let mut seed = 1u64;
        let mut random = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let mut told = 0;
        for _ in 0..20_000 {
            let c: Vec<f64> = (0..7).map(|k| random() + if k == 0 { 0.5 } else { 0.0 }).collect();
            if is_positive(&mut c.clone()) {
                told += 1;
                let at = |s: f64| c.iter().rev().fold(0.0, |sum, c| sum * s + c);
                assert!((1..=200).all(|k| at(f64::from(k) / 200.0) > 0.0), "{c:?}");
            }
        }
        assert!(told > 2000, "{told}");
    }
}
