//! The designed law: its states, its block, and its linear part at a position of the joints.

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
    /// x̂, ξ, last readings, governed references, commands: where each begins.
    fn places(&self) -> [usize; 5] {
        let [n, k, r, p, _] = self.data.sizes();
        [0, n, n + k, n + k + p, n + k + p + r]
    }

    /// The linear part with these numbers.
    fn linear_of(&self, data: &RegulatorData) -> LinearLaw {
        let RegulatorData { prediction, input, output, correction, model, model_input, feedback, .. } = data;
        let [n, k, r, p, m] = self.data.sizes();
        let size = self.states.len();
        let [_, models, readings, governed, _] = self.places();
        let [angles, speeds] = rows(&self.readings, self.shafts);
        // x̂ after the correction: (I − M C) x̂ + M y.
        let uncorrected = Matrix::identity(n).plus(&correction.multiply(output).scale(&-1.0));
        let on_estimate = Matrix::from_fn(m, n, |i, j| -feedback[(i, j)]);
        let on_states = on_estimate.multiply(&uncorrected);
        let on_readings = on_estimate.multiply(correction);
        let command = Matrix::from_fn(m, size, |i, j| match j {
            j if j < n => on_states[(i, j)],
            j if (models..models + k).contains(&j) => -feedback[(i, n + j - models)],
            _ => 0.0,
        });
        let next_of = |corrected: &Matrix<f64>, commanded: &Matrix<f64>| {
            prediction.multiply(corrected).plus(&input.multiply(commanded))
        };
        let corrected = Matrix::from_fn(n, size, |i, j| if j < n { uncorrected[(i, j)] } else { 0.0 });
        let (next_estimate, next_from_readings) = (next_of(&corrected, &command), next_of(correction, &on_readings));
        let last_command = self.places()[4];
        let states = Matrix::from_fn(size, size, |i, j| match i {
            i if i < n => next_estimate[(i, j)],
            i if (models..models + k).contains(&i) && (models..models + k).contains(&j) => {
                model[(i - models, j - models)]
            }
            i if i >= last_command => command[(i - last_command, j)],
            _ => 0.0,
        });
        let from_readings = Matrix::from_fn(size, p, |i, j| match i {
            i if i < n => next_from_readings[(i, j)],
            i if (readings..readings + p).contains(&i) => f64::from(u8::from(i - readings == j)),
            i if i >= last_command => on_readings[(i - last_command, j)],
            _ => 0.0,
        });
        LinearLaw {
            states,
            angles: from_readings.multiply(&angles),
            speeds: from_readings.multiply(&speeds),
            disturbances: Matrix::zeros(size, 0),
            torques: Matrix::zeros(size, m),
            on_states: command,
            on_angles: on_readings.multiply(&angles),
            on_speeds: on_readings.multiply(&speeds),
            on_disturbances: Matrix::zeros(m, 0),
            references: Matrix::from_fn(size, r, |i, j| match i {
                i if i < n => (0..m).map(|l| -input[(i, l)] * feedback[(l, n + k + j)]).sum(),
                i if (models..models + k).contains(&i) => model_input[(i - models, j)],
                i if (governed..governed + r).contains(&i) => f64::from(u8::from(i - governed == j)),
                i if i >= last_command => -feedback[(i - last_command, n + k + j)],
                _ => 0.0,
            }),
            on_references: Matrix::from_fn(m, r, |i, j| -feedback[(i, n + k + j)]),
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
        let [_, models, readings, governed, _] = self.places();
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
