//! The servo loops that execute a plan: feed-forward of the model, and feedback of the encoder readings.

use std::sync::Arc;

use kardan_rt::functions::exp;

use super::inverse::Inverse;
use super::plan::Trajectory;
use kardan_analysis::OutputSignal;
use kardan_identify::Motion;
use kardan_math::num::{Cholesky, Matrix, StateArchive, dot};
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::{Kinematics, Reduced};
use kardan_results::Design;
use kardan_results::signal_name::Quantity;
use kardan_synthesis::{Block, Clock, Law, LinearLaw, Observation, Reference};

/// Poles of the filter that finds speeds from encoder readings, in bandwidths of the loop.
const FILTER: f64 = 10.0;

/// Reads encoders, commands all motors. The plan starts at the first readings.
///
/// From the readings a tracking filter with a double pole finds position and speed of the reduced coordinates; the commanded acceleration
/// is that of the plan plus `3ω(v_p − v) + 3ω²(q_p − q) + ω³ ∫(q_p − q)`, a triple pole at −ω; the torques follow from the
/// model's inverse dynamics at the planned motion. At a torque limit the integral stops.
#[derive(Clone)]
pub(super) struct Servo {
    inputs: Vec<String>,
    sensors: Vec<OutputSignal>,
    /// Reduced coordinates from readings, r × readings.
    inverse_of_readings: Matrix<f64>,
    /// Readings at zero coordinates.
    offsets: Vec<f64>,
    /// Shafts with exact readings, if there are not enough encoders.
    shafts: Vec<usize>,
    period: f64,
    bandwidth: f64,
    trajectory: Arc<Trajectory>,
    inverse: Inverse,
    sample: usize,
    /// Start of the plan.
    start: Vec<f64>,
    position: Vec<f64>,
    speed: Vec<f64>,
    integral: Vec<f64>,
    commanded: Vec<f64>,
    measured: Vec<f64>,
    planned: Vec<f64>,
}

/// The encoders of a model with constant ratios of its shafts: name of the sensor, shaft.
pub(super) fn encoders(reduced: &Reduced) -> Vec<(String, usize)> {
    let kinematics = Kinematics::new(reduced);
    let sensors = reduced.equations.sensors.iter();
    let angle = |(name, sensor): &(String, kardan_mechanics::equations::Sensor)| match &sensor.measured {
        Measured::Angle(shaft) => {
            reduced.coordinate(shaft).filter(|shaft| !kinematics.is_varying(*shaft)).map(|shaft| (name.clone(), shaft))
        }
        _ => None,
    };
    sensors.filter_map(angle).collect()
}

impl Servo {
    /// For a model; the plant may have more coordinates, its shafts are the same. The second value states whether the encoders suffice:
    /// otherwise the loops read the exact angles of the coordinates.
    pub fn new(
        reduced: &Reduced,
        motors: &[usize],
        trajectory: Arc<Trajectory>,
        period: f64,
        bandwidth: f64,
    ) -> (Self, bool) {
        let r = reduced.degrees_of_freedom();
        let kinematics = Kinematics::at_rest(reduced, &vec![0.0; r]);
        let encoders = encoders(reduced);
        let found = inverse_of(encoders.iter().map(|(_, shaft)| kinematics.row(*shaft)), r);
        let complete = found.is_some();
        let (sensors, shafts) = match complete {
            true => (encoders, Vec::new()),
            false => (Vec::new(), reduced.coordinates.clone()),
        };
        let read: Vec<usize> = sensors.iter().map(|(_, shaft)| *shaft).chain(shafts.iter().copied()).collect();
        let inverse_of_readings = found.unwrap_or_else(|| Matrix::from_fn(r, r, |i, j| f64::from(u8::from(i == j))));
        let signal = |(name, shaft): (String, usize)| OutputSignal {
            name: Quantity::Angle.of(&name),
            measured: Measured::Angle(reduced.equations.coordinates[shaft].clone()),
        };
        let servo = Self {
            inputs: motors.iter().map(|&motor| reduced.equations.inputs[motor].element.clone()).collect(),
            sensors: sensors.into_iter().map(signal).collect(),
            offsets: read.iter().map(|&shaft| kinematics.angles[shaft]).collect(),
            measured: vec![0.0; read.len()],
            inverse_of_readings,
            shafts,
            period,
            bandwidth,
            trajectory,
            inverse: Inverse::new(reduced, motors),
            sample: 0,
            start: vec![0.0; r],
            planned: vec![0.0; r],
            position: vec![0.0; r],
            speed: vec![0.0; r],
            integral: vec![0.0; r],
            commanded: vec![0.0; r],
        };
        (servo, complete)
    }
}

/// `(EᵀE)⁻¹Eᵀ` for rows E of full rank.
fn inverse_of<'a>(rows: impl Iterator<Item = &'a [f64]>, r: usize) -> Option<Matrix<f64>> {
    let rows: Vec<&[f64]> = rows.collect();
    let mut square = Matrix::<f64>::zeros(r, r);
    rows.iter().for_each(|row| square.add_outer(&1.0, row));
    let mut factor = Cholesky::new(r);
    if !factor.factor(square.as_slice()) {
        return None;
    }
    let mut out = Matrix::zeros(r, rows.len());
    for (k, row) in rows.iter().enumerate() {
        let mut column = row.to_vec();
        factor.solve(&mut column);
        (0..r).for_each(|i| out[(i, k)] = column[i]);
    }
    Some(out)
}

impl Law for Servo {
    fn inputs(&self) -> &[String] {
        &self.inputs
    }

    fn references(&self) -> &[Reference] {
        &[]
    }

    fn block(&self, _: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(Box::new(self.clone()))
    }

    fn linear_sampled(&self, _: Clock) -> Option<LinearLaw> {
        Some(self.linear())
    }

    fn linear(&self) -> LinearLaw {
        let (inputs, shafts) = (self.inputs.len(), self.inverse.work.kinematics.angles.len());
        LinearLaw::gains(Matrix::zeros(inputs, shafts), Matrix::zeros(inputs, shafts), Matrix::zeros(inputs, 0))
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn clock(&self) -> Option<Clock> {
        Some(Clock { period: self.period, delay: 0.0, single: false })
    }

    fn describe(&self) -> Design {
        Design { controller: "the servo loops of the bench".into(), law: "servo".into(), ..Design::default() }
    }
}

impl Block for Servo {
    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.count(&mut self.sample);
        for list in [&mut self.start, &mut self.position, &mut self.speed, &mut self.integral] {
            archive.numbers(list);
        }
    }

    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let r = self.speed.len();
        let readings = self.measured.len();
        for k in 0..readings {
            let read =
                if self.shafts.is_empty() { observation.readings[k] } else { observation.angles[self.shafts[k]] };
            self.measured[k] = read - self.offsets[k];
        }
        let Motion { position: at, speed: rates, acceleration: accelerations } = self.trajectory.at(self.sample);
        self.sample += 1;
        let decay = exp(-FILTER * self.bandwidth * self.period);
        let (on_position, on_speed) = (1.0 - decay * decay, (1.0 - decay) * (1.0 - decay) / self.period);
        let w = self.bandwidth;
        for i in 0..r {
            let read = dot(&self.inverse_of_readings.as_slice()[i * readings..(i + 1) * readings], &self.measured);
            if self.sample == 1 {
                (self.start[i], self.position[i]) = (read, read);
            }
            self.planned[i] = self.start[i] + at[i];
            let predicted = self.position[i] + self.period * self.speed[i];
            let error = read - predicted;
            self.position[i] = predicted + on_position * error;
            self.speed[i] += self.period * accelerations[i] + on_speed * error;
            let away = self.planned[i] - self.position[i];
            self.commanded[i] = accelerations[i]
                + 3.0 * w * (rates[i] - self.speed[i])
                + 3.0 * w * w * away
                + w * w * w * self.integral[i];
        }
        let motion = Motion { position: &self.planned, speed: rates, acceleration: &self.commanded };
        self.inverse.torques(motion, out);
        let free = self.inverse.meets_limits(out, 1.0);
        for i in 0..r {
            if free {
                self.integral[i] += self.period * (self.planned[i] - self.position[i]);
            }
        }
        for (torque, limit) in out.iter_mut().zip(&self.inverse.limits) {
            if let Some(limit) = limit {
                *torque = torque.clamp(-limit, *limit);
            }
        }
        true
    }
}
