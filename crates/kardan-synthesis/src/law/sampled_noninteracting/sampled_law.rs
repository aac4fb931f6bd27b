//! The designed law: its states, its block, and its linear part at a position of the joints.

use crate::matrix_parts::{column_range, side_by_side, stacked};
use crate::observed::{Reading, rows};
use crate::sampled::{RegulatorBlock, RegulatorData, ScheduleData};
use crate::{Block, Clock, Law, LinearLaw, Reference};
use kardan_analysis::OutputSignal;
use kardan_math::num::Matrix;
use kardan_mechanics::reduce::Kinematics;
use kardan_results::Design;

pub(super) struct Sampled {
    pub(super) clock: Clock,
    pub(super) inputs: Vec<String>,
    pub(super) references: Vec<Reference>,
    pub(super) sensors: Vec<OutputSignal>,
    pub(super) readings: Vec<Reading>,
    pub(super) offsets: Vec<f64>,
    pub(super) coordinates: Vec<usize>,
    pub(super) shafts: usize,
    pub(super) states: Vec<String>,
    /// Straight ahead.
    pub(super) data: RegulatorData,
    pub(super) schedule: Option<ScheduleData>,
    /// The shaft of each channel of a position.
    pub(super) positions: Vec<Option<usize>>,
    pub(super) kinematics: Kinematics,
    pub(super) design: Design,
}

impl Sampled {
    /// Where ξ, the last readings and the governed references begin, behind x̂; last come the commands.
    fn places(&self) -> [usize; 3] {
        let [n, k, _, p, _] = self.data.sizes();
        [n, n + k, n + k + p]
    }

    /// The linear part with these numbers.
    fn linear_of(&self, data: &RegulatorData) -> LinearLaw {
        let RegulatorData { prediction, input, output, correction, model, model_input, feedback, .. } = data;
        let [n, k, r, p, m] = self.data.sizes();
        let size = self.states.len();
        let [angles, speeds] = rows(&self.readings, self.shafts);
        let zeros = Matrix::<f64>::zeros;
        let minus = feedback.scale(&-1.0);
        // x̂ after the correction: (I − M C) x̂ + M y.
        let uncorrected = Matrix::identity(n).minus(&correction.multiply(output));
        let on_estimate = column_range(&minus, 0..n);
        let on_states = on_estimate.multiply(&uncorrected);
        let on_readings = on_estimate.multiply(correction);
        // Behind estimates and reference models there are readings, governed references and commands of the last sample.
        let last = p + r + m;
        let command = side_by_side(&[&on_states, &column_range(&minus, n..n + k), &zeros(m, last)]);
        let next_of = |corrected: &Matrix<f64>, commanded: &Matrix<f64>| {
            prediction.multiply(corrected).plus(&input.multiply(commanded))
        };
        let corrected = side_by_side(&[&uncorrected, &zeros(n, k + last)]);
        let (next_estimate, next_from_readings) = (next_of(&corrected, &command), next_of(correction, &on_readings));
        let next_model = side_by_side(&[&zeros(k, n), model, &zeros(k, last)]);
        let readings = [&next_from_readings, &zeros(k, p), &Matrix::identity(p), &zeros(r, p), &on_readings];
        let from_readings = stacked(&readings);
        let on_references = column_range(&minus, n + k..n + k + r);
        let fed = |i: usize, j: usize| -> f64 { (0..m).map(|l| -input[(i, l)] * feedback[(l, n + k + j)]).sum() };
        let next_from_references = Matrix::from_fn(n, r, fed);
        let references = [&next_from_references, model_input, &zeros(p, r), &Matrix::identity(r), &on_references];
        LinearLaw {
            states: stacked(&[&next_estimate, &next_model, &zeros(p + r, size), &command]),
            angles: from_readings.multiply(&angles),
            speeds: from_readings.multiply(&speeds),
            disturbances: Matrix::zeros(size, 0),
            torques: Matrix::zeros(size, m),
            on_states: command,
            on_angles: on_readings.multiply(&angles),
            on_speeds: on_readings.multiply(&speeds),
            on_disturbances: Matrix::zeros(m, 0),
            references: stacked(&references),
            on_references,
            // Without sensors of its own the law reads true angles and speeds.
            errors: if self.sensors.is_empty() { Matrix::zeros(size, 0) } else { from_readings.clone() },
            on_errors: if self.sensors.is_empty() { Matrix::zeros(m, 0) } else { on_readings.clone() },
            flowing: false,
        }
    }
}

impl Law for Sampled {
    fn inputs(&self) -> &[String] {
        &self.inputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn states(&self) -> Vec<String> {
        self.states.clone()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        for (state, &shaft) in out.iter_mut().zip(&self.coordinates) {
            *state = angles[shaft];
        }
        let [models, readings, governed] = self.places();
        // Reference models begin at the values of their outputs.
        for (k, shaft) in self.positions.iter().enumerate() {
            if let Some(shaft) = *shaft {
                (out[models + 2 * k], out[models + 2 * k + 1]) = (angles[shaft], speeds[shaft]);
                out[governed + k] = angles[shaft];
            }
        }
        for (k, reading) in self.readings.iter().enumerate() {
            out[readings + k] = reading.read(angles, speeds) - self.offsets[k];
        }
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let clock = clock.filter(|clock| clock.period == self.clock.period)?;
        let (data, schedule) = (&self.data, self.schedule.as_ref());
        Some(match clock.single {
            true => Box::new(RegulatorBlock::<f32>::new(data, schedule, &self.readings, &self.offsets)),
            false => Box::new(RegulatorBlock::<f64>::new(data, schedule, &self.readings, &self.offsets)),
        })
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        (clock.period == self.clock.period).then(|| self.linear())
    }

    fn linear(&self) -> LinearLaw {
        self.linear_of(&self.data)
    }

    fn is_nonlinear(&self) -> bool {
        self.schedule.is_some()
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        let Some(schedule) = &self.schedule else { return Some(self.linear()) };
        let mut data = schedule.at(position[schedule.coordinate])?;
        // What the block expects of the readings is exact between the points too.
        let (mut kinematics, r) = (self.kinematics.clone(), self.coordinates.len());
        kinematics.update(position, &vec![0.0; r]);
        let basis = Matrix::from_fn(self.shafts, r, |i, j| kinematics.basis[i * r + j]);
        let [angles, speeds] = rows(&self.readings, self.shafts).map(|of| of.multiply(&basis));
        data.output = Matrix::from_fn(data.output.rows(), data.output.columns(), |i, j| match j {
            j if j < r => angles[(i, j)],
            j if j < 2 * r => speeds[(i, j - r)],
            _ => 0.0,
        });
        Some(self.linear_of(&data))
    }

    fn describe(&self) -> Design {
        self.design.clone()
    }
}
