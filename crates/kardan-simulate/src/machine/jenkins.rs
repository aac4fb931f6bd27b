//! Friction elements in series with springs on a motion without inertia (Jenkins and Iwan elements): they stick or slip
//! at constant torque.
//!
//! No acceleration decides: while an element sticks its torque is that of the springs, while it slips the springs keep
//! their torque. It begins to slip where that torque reaches the friction and grows, and sticks where its motion
//! reverses. Springs without inertia between elements couple their slips: with the torques τ of the springs,
//! `τ̇ = r − S_y ẏ`, and of those at their limits each either slips onwards, `τ̇ = 0`, or sticks while its torque
//! falls. That is the convex problem of friction with slip speeds for torques, `½ ẏᵀS_yẏ − rᵀẏ` least over the speeds
//! that each may have; S_y is positive definite, so its solution is unique.

use super::Machine;
use super::jenkins_springs::JenkinsElements;
use crate::friction::{Bounds, Mode, NOISE};
use kardan_math::num::Cholesky;

/// The rounding error of the torque of an element at its limit, relative to the friction.
const AT_LIMIT: f64 = 1e-12;
/// Growth of a torque, relative to the sizes of the terms that cancel in it, that is rounding: it counts as constant.
const ROUNDING: f64 = 1e-12;

impl Machine {
    /// The torque of a slider's springs at the point last evaluated, N m.
    pub(super) fn jenkins_torque(&self, element: usize) -> f64 {
        self.work.more(&self.dynamics, self.places.jenkins_torques.start + element)
    }

    /// The rate of the torque of its springs at the point last evaluated, N m/s; zero where it may be only rounding.
    fn growth(&self, element: usize) -> f64 {
        let terms = self.jenkins.rows[element].iter().map(|(shaft, x)| x * self.work.kinematics.speeds[*shaft]);
        let growth: f64 = terms.sum();
        if growth.abs() <= self.growth_noise(element) { 0.0 } else { growth }
    }

    fn growth_noise(&self, element: usize) -> f64 {
        let JenkinsElements { directions, stiffness, .. } = &self.jenkins;
        let [here, over_step] = self.growth_terms(element);
        // The slip speeds cancel too in the convex problem.
        let slips = directions.iter().map(|&direction| match self.modes[direction] {
            Mode::Stick => 0.0,
            _ => self.dynamics.friction_speed(direction, &self.work),
        });
        let row = &stiffness[element * directions.len()..][..directions.len()];
        let slip_scale: f64 = row.iter().zip(slips).map(|(s, speed)| (s * speed).abs()).sum();
        ROUNDING * (here + slip_scale) + NOISE * over_step
    }

    /// Bound of the cancellation in the rate of a torque, N m/s: at the point last evaluated, and within the step.
    fn growth_terms(&self, element: usize) -> [f64; 2] {
        let kinematics = &self.work.kinematics;
        let mut sizes = [0.0; 2];
        for (shaft, x) in &self.jenkins.rows[element] {
            let moved = kinematics.row(*shaft).iter().zip(&self.step_speeds).zip(&self.jenkins.is_state);
            let moved = moved.filter(|(_, is_state)| !**is_state).map(|((entry, size), _)| (entry * size).abs());
            sizes[0] += (x * kinematics.speeds[*shaft]).abs();
            sizes[1] += x.abs() * moved.sum::<f64>();
        }
        sizes
    }

    /// The rounding error of the slip speed in a direction, rad/s, if it is that of a slider.
    pub(super) fn noise_of_slip(&self, direction: usize) -> Option<f64> {
        let JenkinsElements { directions, pairs, couplings, .. } = &self.jenkins;
        let element = directions.iter().position(|own| *own == direction)?;
        let slip_noise =
            |element: usize| self.growth_terms(element).iter().sum::<f64>() / self.jenkins.stiffness(element);
        let coupled = pairs.iter().zip(couplings).filter(|((i, _), _)| *i == element);
        let terms: Vec<f64> = coupled.map(|((_, j), coupling)| (coupling * slip_noise(*j)).abs()).collect();
        Some(NOISE * if terms.is_empty() { slip_noise(element) } else { terms.iter().sum() })
    }

    /// Whether a slider that sticks leaves at the point last evaluated.
    pub(super) fn jenkins_slip(&self) -> bool {
        self.jenkins.directions.iter().enumerate().any(|(element, &direction)| {
            let torque = self.jenkins_torque(element);
            self.modes[direction] == Mode::Stick
                && torque.abs() >= self.dynamics.friction_torques()[direction]
                && torque * self.growth(element) > 0.0
        })
    }

    /// Selects their modes at the point last evaluated; `crossing` are directions whose motion has just reversed.
    /// Returns whether one changes.
    pub(super) fn decide_jenkins_modes(&mut self, crossing: &[usize], everything: bool) -> bool {
        let count = self.jenkins.directions.len();
        if count == 0 {
            return false;
        }
        let may_slip = |element: usize| {
            let direction = self.jenkins.directions[element];
            let (torque, mode) = (self.jenkins_torque(element), self.modes[direction]);
            if mode != Mode::Stick && !everything {
                return if crossing.contains(&direction) { 0.0 } else { mode.sign() };
            }
            let at_limit = torque.abs() >= self.dynamics.friction_torques()[direction] * (1.0 - AT_LIMIT);
            if at_limit { torque.signum() } else { 0.0 }
        };
        let senses: Vec<f64> = (0..count).map(may_slip).collect();
        // A growth of rounding size causes no slip.
        let right = |element: usize| {
            let uncoupled_speed = self.work.more(&self.dynamics, self.places.jenkins_speeds.start + element);
            let right = self.jenkins.stiffness(element) * uncoupled_speed;
            if right.abs() <= self.growth_noise(element) { 0.0 } else { right }
        };
        let right: Vec<f64> = (0..count).map(right).collect();
        let [forward, backward] = [1.0, -1.0].map(|sense| {
            senses.iter().map(|own| if *own == sense { f64::INFINITY } else { 0.0 }).collect::<Vec<f64>>()
        });
        let mut speeds = vec![0.0; count];
        let bounds = Bounds { forward: &forward, backward: &backward };
        self.box_problem.solve(&self.jenkins.stiffness, &right, bounds, &mut speeds);
        let mut changed = false;
        for (speed, &direction) in speeds.iter().zip(&self.jenkins.directions) {
            let mode = Mode::of(*speed);
            changed |= self.modes[direction] != mode;
            self.modes[direction] = mode;
        }
        if changed {
            self.couple_jenkins();
        }
        changed
    }

    /// The mutual slip factors of coupled sliders in the present modes: `S_AA⁻¹ diag S_AA` over those that slip.
    pub(super) fn couple_jenkins(&mut self) {
        let JenkinsElements { directions, stiffness, pairs, couplings, .. } = &mut self.jenkins;
        if pairs.is_empty() {
            return;
        }
        let n = directions.len();
        let slipping: Vec<usize> = (0..n).filter(|k| self.modes[directions[*k]] != Mode::Stick).collect();
        let count = slipping.len();
        let matrix: Vec<f64> =
            (0..count * count).map(|k| stiffness[slipping[k / count] * n + slipping[k % count]]).collect();
        let mut factor = Cholesky::new(count);
        let regular = factor.factor(&matrix);
        let mut columns = vec![vec![0.0; n]; n];
        for (a, &j) in slipping.iter().enumerate() {
            let mut column = vec![0.0; count];
            column[a] = if regular { stiffness[j * n + j] } else { f64::NAN };
            factor.solve(&mut column);
            slipping.iter().zip(column).for_each(|(&i, x)| columns[j][i] = x);
        }
        pairs.iter().zip(couplings).for_each(|((i, j), coupling)| *coupling = columns[*j][*i]);
    }

    /// The margin of the sticking sliders to their friction, as a part of it, at the point last evaluated.
    pub(super) fn jenkins_margins(&self) -> impl Iterator<Item = (usize, f64)> {
        let sticking = self.jenkins.directions.iter().enumerate().filter(|(_, k)| self.modes[**k] == Mode::Stick);
        sticking
            .map(|(element, &k)| (k, 1.0 - self.jenkins_torque(element).abs() / self.dynamics.friction_torques()[k]))
    }
}
