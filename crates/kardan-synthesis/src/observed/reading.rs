//! Readings of sensors.

use kardan_rt::{Row, Sensor};

use crate::{Plant, SynthesisError};
use kardan_analysis::OutputSignal;
use kardan_math::num::Matrix;
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::Reduced;

/// A reading: a sum of coefficients times angles, or times speeds, less a constant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    pub row: Vec<(usize, f64)>,
    pub speed: bool,
    rest: f64,
    /// The shaft whose angle or speed it is.
    pub shaft: Option<usize>,
}

impl Reading {
    /// What a sensor of this reads; `None` of what does not follow from angles and speeds.
    pub fn of(measured: &Measured, reduced: &Reduced) -> Option<Self> {
        let plain = |name: &String, speed: bool| {
            let shaft = reduced.coordinate(name)?;
            Some(Self { row: vec![(shaft, 1.0)], speed, rest: 0.0, shaft: Some(shaft) })
        };
        match measured {
            Measured::Angle(name) => plain(name, false),
            Measured::Speed(name) => plain(name, true),
            Measured::SpringTorque(element) => {
                let mut out = Self { row: Vec::new(), speed: false, rest: 0.0, shaft: None };
                for spring in reduced.equations.springs.iter().filter(|spring| spring.element == *element) {
                    let stiffness = spring.value.stiffness.to_f64();
                    out.row.extend(spring.row_f64().into_iter().map(|(shaft, x)| (shaft, stiffness * x)));
                    out.rest += stiffness * spring.value.rest.to_f64();
                }
                Some(out)
            }
            Measured::ConstraintTorque(..)
            | Measured::ComplianceTorque(..)
            | Measured::NetTorque(_)
            | Measured::Signal(_) => None,
        }
    }

    /// The value at angles and speeds of all shafts.
    pub fn read(&self, angles: &[f64], speeds: &[f64]) -> f64 {
        let of = if self.speed { speeds } else { angles };
        self.row.iter().map(|(shaft, x)| x * of[*shaft]).sum::<f64>() - self.rest
    }
}

/// The reading of a sensor.
pub(crate) fn reading(sensor: &OutputSignal, plant: &Plant) -> Result<Reading, SynthesisError> {
    Reading::of(&sensor.measured, &plant.reduced).ok_or_else(|| {
        let name = &sensor.name;
        SynthesisError::at(
            format!("`{name}` depends directly on the motor torques, so an observer cannot measure it"),
            name,
            "not for an observer",
            "let the observer measure angles, speeds and torques of springs",
        )
    })
}

/// The readings as a block reads them: what a sensor is, and the list of shafts and coefficients that its row is a part of.
pub(crate) fn sensors(readings: &[Reading]) -> (Vec<Sensor<f64>>, Vec<(usize, f64)>) {
    let mut terms = Vec::new();
    let one = |reading: &Reading| {
        let row = Row { first: terms.len(), count: reading.row.len() };
        terms.extend_from_slice(&reading.row);
        Sensor { row, speed: reading.speed, rest: reading.rest }
    };
    (readings.iter().map(one).collect(), terms)
}

/// The sensors as rows of a table.
pub(crate) fn sensor_table(sensors: &[Sensor<f64>]) -> Vec<Vec<f64>> {
    let sensor = |sensor: &Sensor<f64>| {
        let Row { first, count } = sensor.row;
        vec![first as f64, count as f64, f64::from(u8::from(sensor.speed)), sensor.rest]
    };
    sensors.iter().map(sensor).collect()
}

/// The readings as rows over angles and speeds of all shafts.
pub(crate) fn rows(readings: &[Reading], shafts: usize) -> [Matrix<f64>; 2] {
    let mut angles = Matrix::zeros(readings.len(), shafts);
    let mut speeds = Matrix::zeros(readings.len(), shafts);
    for (i, reading) in readings.iter().enumerate() {
        let of = if reading.speed { &mut speeds } else { &mut angles };
        reading.row.iter().for_each(|(shaft, x)| of[(i, *shaft)] += x);
    }
    [angles, speeds]
}
