//! The inputs of a law with an observer.

use kardan_rt::hold;

use super::reading::Reading;
use crate::{Observation, Plant};
use kardan_math::num::{Matrix, StateArchive};
use kardan_mechanics::reduce::Kinematics;

/// From readings and estimates to the inputs of the law.
#[derive(Clone)]
pub(super) struct EstimatedView {
    pub readings: Vec<Reading>,
    pub coordinates: Vec<usize>,
    /// The states that are estimated, as places among `[q_r; q̇_r]`, and what each is over these.
    pub retained: Vec<usize>,
    pub measured: Matrix<f64>,
    pub compensation: f64,
    /// Rates of the coordinates at the operating point: currents that flow there.
    rates: Vec<f64>,
    /// The readings of the sensors at the operating point, which the linear model does not contain.
    pub offsets: Vec<f64>,
    pub kinematics: Kinematics,
    /// Readings that were not finite.
    pub invalid_readings: usize,
    // Memory of one evaluation; of the values those that were finite last.
    pub values: Vec<f64>,
    position: Vec<f64>,
    speed: Vec<f64>,
    pub disturbances: Vec<f64>,
}

impl EstimatedView {
    /// At the start of a run; `disturbed`: how many torques are estimated.
    pub fn new(
        readings: Vec<Reading>,
        plant: &Plant,
        compensation: f64,
        (retained, measured): (Vec<usize>, Matrix<f64>),
        disturbed: usize,
    ) -> Self {
        let r = plant.linear.coordinates.len();
        let kinematics = plant.kinematics();
        let at_rest: Vec<f64> = readings.iter().map(|one| one.read(&kinematics.angles, &kinematics.speeds)).collect();
        Self {
            rates: plant.point.rates.clone(),
            offsets: at_rest.clone(),
            values: at_rest,
            invalid_readings: 0,
            readings,
            coordinates: plant.reduced.coordinates.clone(),
            retained,
            measured,
            compensation,
            kinematics,
            position: vec![0.0; r],
            speed: vec![0.0; r],
            disturbances: vec![0.0; disturbed],
        }
    }

    /// The initial value of the rate at a place among `[q_r; q̇_r]`.
    pub fn rate_at_rest(&self, place: usize) -> f64 {
        place.checked_sub(self.rates.len()).and_then(|k| self.rates.get(k)).copied().unwrap_or(0.0)
    }

    /// States of the observer: coordinates, speeds, disturbances.
    pub fn states(&self) -> usize {
        self.retained.len() + self.disturbances.len()
    }

    /// Its part of a snapshot.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.values);
        archive.count(&mut self.invalid_readings);
    }

    /// Takes the readings: those of the sensors, or ideal ones where there are none. Where one is not finite, the last good one
    /// stays; returns how many are not.
    pub fn read(&mut self, observation: &Observation<'_>) -> usize {
        if observation.readings.is_empty() {
            for (value, reading) in self.values.iter_mut().zip(&self.readings) {
                *value = reading.read(observation.angles, observation.speeds);
            }
            return 0;
        }
        hold(observation.readings, &mut self.values)
    }

    /// The inputs of the law, its own states after those of the observer: estimates, replaced by measurements where there are some.
    pub fn estimate<'a>(&'a mut self, observation: &Observation<'a>) -> Observation<'a> {
        self.invalid_readings = self.read(observation);
        let r = self.coordinates.len();
        let own = self.states();
        for (&k, state) in self.retained.iter().zip(observation.states) {
            if k < r { self.position[k] = *state } else { self.speed[k - r] = *state }
        }
        for (reading, value) in self.readings.iter().zip(&self.values) {
            let of = if reading.speed { &mut self.speed } else { &mut self.position };
            if let Some(place) = self.coordinates.iter().position(|coordinate| reading.shaft == Some(*coordinate)) {
                of[place] = *value;
            }
        }
        self.kinematics.update(&self.position, &self.speed);
        for (disturbances, torque) in self.disturbances.iter_mut().zip(&observation.states[self.retained.len()..]) {
            *disturbances = self.compensation * torque;
        }
        Observation {
            time: observation.time,
            angles: &self.kinematics.angles,
            speeds: &self.kinematics.speeds,
            disturbances: &self.disturbances,
            references: observation.references,
            readings: &[],
            states: &observation.states[own..],
        }
    }
}
