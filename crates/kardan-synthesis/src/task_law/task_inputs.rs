//! The source of each input of a task, and what ideal sensors read.

use crate::Observation;
use kardan_math::num::{Rational, SparseRow, rational_to_f64};
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::Reduced;

/// The source of an input of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Comes {
    Angle(usize),
    Speed(usize),
    /// The last good reading of a sensor.
    Reading(usize),
    /// Its output, a number or none.
    AsRead(usize),
    Reference(usize),
    Time,
}

/// What an ideal sensor reads: rows over angles and speeds, and its reading at zero angles; for a signal the reference that supplies it.
#[derive(Debug, Clone, Default)]
pub(super) struct Ideal {
    angles: Vec<(usize, f64)>,
    speeds: Vec<(usize, f64)>,
    /// The same before rounding.
    pub(super) exact: [SparseRow; 2],
    offset: f64,
    pub(super) reference: Option<usize>,
}

impl Ideal {
    pub(super) fn new(measured: &Measured, reduced: &Reduced) -> Self {
        let coordinate = |name: &String| reduced.coordinate(name).expect("a sensor names a coordinate");
        match measured {
            Measured::Angle(name) => Self::of_rows([vec![(coordinate(name), Rational::ONE)], SparseRow::new()], 0.0),
            Measured::Speed(name) => Self::of_rows([SparseRow::new(), vec![(coordinate(name), Rational::ONE)]], 0.0),
            Measured::SpringTorque(element) => {
                let (mut row, mut offset) = (SparseRow::new(), 0.0);
                for spring in reduced.equations.springs.iter().filter(|spring| spring.element == *element) {
                    let stiffness = spring.value.stiffness.to_rational();
                    row.extend(spring.row.iter().map(|(shaft, x)| (*shaft, &stiffness * x)));
                    offset -= spring.value.stiffness.to_f64() * spring.value.rest.to_f64();
                }
                Self::of_rows([row, SparseRow::new()], offset)
            }
            // Its spring and its damper read it in a run; it has no effect on small motions. A signal is an input.
            Measured::ComplianceTorque(..)
            | Measured::ConstraintTorque(..)
            | Measured::NetTorque(_)
            | Measured::Signal(_) => Self::default(),
        }
    }

    fn of_rows(exact: [SparseRow; 2], offset: f64) -> Self {
        let rounded = |row: &SparseRow| row.iter().map(|(k, x)| (*k, rational_to_f64(x))).collect();
        let [angles, speeds] = exact.each_ref().map(rounded);
        Self { angles, speeds, exact, offset, reference: None }
    }

    pub(super) fn read(&self, observation: &Observation<'_>) -> f64 {
        let row_dot = |row: &[(usize, f64)], x: &[f64]| -> f64 { row.iter().map(|(k, c)| c * x[*k]).sum() };
        let reference = self.reference.map_or(0.0, |k| observation.references[k]);
        row_dot(&self.angles, observation.angles) + row_dot(&self.speeds, observation.speeds) + reference + self.offset
    }
}
