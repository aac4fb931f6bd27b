//! Torques of the motors for a motion, computed with the model: inverse dynamics with friction, shared among the motors.

use kardan_rt::functions::powi;

use kardan_identify::Motion;
use kardan_math::num::{Cholesky, dot};
use kardan_mechanics::reduce::{Dynamics, Reduced, Work};
use kardan_synthesis::Plant;

/// Speed along a friction direction below which it counts as sticking in a plan, rad/s.
const REST: f64 = 1e-9;

/// The model's inverse dynamics with its own work memory.
#[derive(Clone)]
pub(super) struct Inverse {
    pub dynamics: Dynamics,
    pub work: Work,
    /// Numbers of the motors among the inputs.
    pub motors: Vec<usize>,
    /// Their torque limits, N m; `None`: unlimited.
    pub limits: Vec<Option<f64>>,
    /// Squares of the limits against the largest one: a motor with a high limit takes more.
    weights: Vec<f64>,
    force: Vec<f64>,
    matrix: Vec<f64>,
    factor: Cholesky,
}

impl Inverse {
    /// For these motors of a model.
    pub fn new(reduced: &Reduced, motors: &[usize]) -> Self {
        let (dynamics, work) = Dynamics::new(reduced);
        let plant = Plant::new(reduced.clone(), vec![0.0; reduced.degrees_of_freedom()]);
        let limits: Vec<Option<f64>> = motors.iter().map(|&motor| plant.torque_limit(motor)).collect();
        let largest = limits.iter().flatten().copied().fold(0.0, f64::max);
        let weight = |limit: &Option<f64>| limit.map_or(1.0, |limit| powi(limit / largest, 2));
        let r = dynamics.degrees_of_freedom;
        Self {
            weights: limits.iter().map(weight).collect(),
            limits,
            motors: motors.to_vec(),
            force: vec![0.0; r],
            matrix: vec![0.0; r * r],
            factor: Cholesky::new(r),
            dynamics,
            work,
        }
    }

    fn row(&self, motor: usize) -> &[f64] {
        let r = self.dynamics.degrees_of_freedom;
        &self.work.input_rows[self.motors[motor] * r..(self.motors[motor] + 1) * r]
    }

    /// Torques (N m) for reduced accelerations at a reduced position and speed, the smallest relative to the limits; false, and zeros,
    /// if the motors cannot drive every motion there. Allocates nothing.
    pub fn torques(&mut self, motion: Motion<'_>, out: &mut [f64]) -> bool {
        let r = self.dynamics.degrees_of_freedom;
        out.fill(0.0);
        self.dynamics.update(motion.position, motion.speed, &mut self.work);
        for i in 0..r {
            self.force[i] = dot(&self.work.inertia[i * r..(i + 1) * r], motion.acceleration) - self.work.passive[i];
        }
        for k in 0..self.dynamics.friction_count() {
            let slip_speed = self.dynamics.friction_speed(k, &self.work);
            if slip_speed.abs() > REST {
                let torque = self.dynamics.friction_torques()[k].copysign(slip_speed);
                let row = &self.work.friction_rows[k * r..(k + 1) * r];
                self.force.iter_mut().zip(row).for_each(|(force, g)| *force += torque * g);
            }
        }
        self.matrix.fill(0.0);
        for (motor, weight) in self.weights.iter().enumerate() {
            let row = &self.work.input_rows[self.motors[motor] * r..(self.motors[motor] + 1) * r];
            for i in 0..r {
                for j in 0..r {
                    self.matrix[i * r + j] += weight * row[i] * row[j];
                }
            }
        }
        if !self.factor.factor(&self.matrix) {
            return false;
        }
        self.factor.solve(&mut self.force);
        for (motor, out) in out.iter_mut().enumerate() {
            *out = self.weights[motor] * dot(self.row(motor), &self.force);
        }
        true
    }

    /// Whether torques stay within a fraction of the limits.
    pub fn meets_limits(&self, torques: &[f64], part: f64) -> bool {
        let fits = |(torque, limit): (&f64, &Option<f64>)| limit.is_none_or(|limit| torque.abs() <= part * limit);
        torques.iter().zip(&self.limits).all(fits)
    }
}
