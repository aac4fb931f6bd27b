//! Readings of sensors.

use kardan_rt::{Row, Sensor};

use crate::{Plant, SynthesisError};
use kardan_analysis::OutputSignal;
use kardan_math::num::{Matrix, rational_to_f64};
use kardan_mechanics::equations::Measured;

/// The source of a reading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Reading {
    Angle(usize),
    Speed(usize),
    /// Sum of coefficients times angles, less a constant.
    Twist(Vec<(usize, f64)>, f64),
}

impl Reading {
    /// The value at angles and speeds of all shafts.
    pub fn read(&self, angles: &[f64], speeds: &[f64]) -> f64 {
        match self {
            Self::Angle(shaft) => angles[*shaft],
            Self::Speed(shaft) => speeds[*shaft],
            Self::Twist(row, rest) => row.iter().map(|(shaft, x)| x * angles[*shaft]).sum::<f64>() - rest,
        }
    }
}

/// The reading of a sensor.
pub(crate) fn reading(sensor: &OutputSignal, plant: &Plant) -> Result<Reading, SynthesisError> {
    let shaft = |name: &String| plant.reduced.coordinate(name).expect("an output names a shaft");
    Ok(match &sensor.measured {
        Measured::Angle(name) => Reading::Angle(shaft(name)),
        Measured::Speed(name) => Reading::Speed(shaft(name)),
        Measured::SpringTorque(element) => {
            let springs = plant.reduced.equations.springs.iter().filter(|spring| spring.element == *element);
            let (mut row, mut rest) = (Vec::new(), 0.0);
            for spring in springs {
                let stiffness = spring.value.stiffness.to_f64();
                row.extend(spring.row.iter().map(|(shaft, x)| (*shaft, stiffness * rational_to_f64(x))));
                rest += stiffness * spring.value.rest.to_f64();
            }
            Reading::Twist(row, rest)
        }
        Measured::ConstraintTorque(..)
        | Measured::ComplianceTorque(..)
        | Measured::NetTorque(_)
        | Measured::Signal(_) => {
            let name = &sensor.name;
            return Err(SynthesisError::at(
                format!("`{name}` depends directly on the motor torques, so an observer cannot measure it"),
                name,
                "not for an observer",
                "let the observer measure angles, speeds and torques of springs",
            ));
        }
    })
}

/// The readings as a block reads them: what a sensor is, and the list of shafts and coefficients that its row is a part of.
pub(crate) fn sensors(readings: &[Reading]) -> (Vec<Sensor<f64>>, Vec<(usize, f64)>) {
    let mut terms = Vec::new();
    let one = |reading: &Reading| {
        let first = terms.len();
        match reading {
            Reading::Angle(shaft) | Reading::Speed(shaft) => terms.push((*shaft, 1.0)),
            Reading::Twist(row, _) => terms.extend_from_slice(row),
        }
        let rest = if let Reading::Twist(_, rest) = reading { *rest } else { 0.0 };
        let row = Row { first, count: terms.len() - first };
        Sensor { row, speed: matches!(reading, Reading::Speed(_)), rest }
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
        match reading {
            Reading::Angle(shaft) => angles[(i, *shaft)] = 1.0,
            Reading::Speed(shaft) => speeds[(i, *shaft)] = 1.0,
            Reading::Twist(row, _) => row.iter().for_each(|(shaft, x)| angles[(i, *shaft)] += x),
        }
    }
    [angles, speeds]
}
