//! Laws as firmware runs them: once every sample time, on readings of sensors, in single or double precision.

use std::sync::Arc;

use kardan_rt::Health;

use crate::analysis::OutputSignal;
use crate::num::{Float, Keeper, Matrix, discretise};
use crate::results::Design;
use crate::synthesis::{ExactLoop, Law, LinearLaw, Reference, Running, Seen};

/// When and in which arithmetic a controller runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Sample time T, s.
    pub period: f64,
    /// From the reading of the sensors to the change of the commands, s; held from there on until the next change.
    pub delay: f64,
    /// Whether the controller computes in `f32`.
    pub single: bool,
}

/// The block of a law at a sample time: the code of `kardan-rt` with its memory.
pub trait Block: Send {
    /// Commands in N m.
    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]);
    /// Its own states at the next sample, if its inputs apply these torques (N m) in between.
    fn next(&mut self, _seen: Seen<'_>, _torques: &[f64], _out: &mut [f64]) {}
    /// What it remembers besides its states, such as the last answer.
    fn keep(&mut self, keeper: &mut Keeper<'_>);
    /// What went wrong at the last sample, and was dealt with.
    fn health(&self) -> Health {
        Health::default()
    }
}

/// What a block says of its last sample.
pub(in crate::synthesis) fn keep_health(health: &mut Health, keeper: &mut Keeper<'_>) {
    let Health { readings_held, references_held, commands_bounded, governed, estimate_kept } = health;
    [readings_held, references_held, commands_bounded].into_iter().for_each(|count| keeper.count(count));
    [governed, estimate_kept].into_iter().for_each(|flag| keeper.flag(flag));
}

/// A law at a sample time.
pub struct Firmware {
    /// What runs.
    pub block: Box<dyn Block>,
    /// Its linear part, `ξ⁺ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ`, `u = C ξ + …`, with the torques τ commanded, within the
    /// motors' torque limits, on average until the next sample; lag and rate limit are not in them.
    pub linear: LinearLaw,
}

/// A law as it runs at a sample time; `None` if its numbers overflow there, or if it is for another sample time.
///
/// The states of a law in continuous time are integrated exactly for signals held over the sample time.
pub fn sampled(law: Arc<dyn Law>, clock: Clock) -> Option<Arc<dyn Law>> {
    let Firmware { linear, .. } = law.firmware(clock)?;
    Some(Arc::new(Sampled { law, linear, clock }))
}

struct Sampled {
    law: Arc<dyn Law>,
    linear: LinearLaw,
    clock: Clock,
}

impl Law for Sampled {
    fn inputs(&self) -> &[String] {
        self.law.inputs()
    }

    fn references(&self) -> &[Reference] {
        self.law.references()
    }

    fn sensors(&self) -> &[OutputSignal] {
        self.law.sensors()
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn states(&self) -> Vec<String> {
        self.law.states()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        self.law.start(angles, speeds, out);
    }

    fn run(&self) -> Running {
        let Some(firmware) = self.law.firmware(self.clock) else {
            unreachable!("`sampled` has made it for this clock before");
        };
        Running::Sampled(self.clock, firmware.block)
    }

    fn linear(&self) -> LinearLaw {
        self.linear.clone()
    }

    fn bends(&self) -> bool {
        self.law.bends()
    }

    fn linear_at(&self, position: &[f64], _: Option<Clock>) -> Option<LinearLaw> {
        self.law.linear_at(position, Some(self.clock))
    }

    fn exact(&self) -> Option<ExactLoop> {
        self.law.exact()
    }

    fn describe(&self) -> Design {
        self.law.describe()
    }
}

impl LinearLaw {
    /// The law with its states at a sample time, its signals held in between; `None` if a number overflows.
    pub(in crate::synthesis) fn held(&self, period: f64) -> Option<Self> {
        if self.states.rows() == 0 {
            return Some(self.clone());
        }
        let parts = [&self.angles, &self.speeds, &self.disturbances, &self.torques, &self.references, &self.errors];
        let found = discretise(&self.states, &side_by_side(&parts), period)?;
        let mut first = 0;
        let [angles, speeds, disturbances, torques, references, errors] = parts.map(|part| {
            let start = first;
            first += part.columns();
            Matrix::from_fn(part.rows(), part.columns(), |i, j| found.b[(i, start + j)])
        });
        Some(Self { states: found.a, angles, speeds, disturbances, torques, references, errors, ..self.clone() })
    }
}

/// Matrices with the same number of rows beside each other.
pub(in crate::synthesis) fn side_by_side(parts: &[&Matrix<f64>]) -> Matrix<f64> {
    let rows = parts.first().map_or(0, |part| part.rows());
    let columns = parts.iter().map(|part| part.columns()).sum();
    let mut out = Matrix::zeros(rows, columns);
    let mut first = 0;
    for part in parts {
        for i in 0..rows {
            for j in 0..part.columns() {
                out[(i, first + j)] = part[(i, j)];
            }
        }
        first += part.columns();
    }
    out
}

/// Entries of a matrix in a precision.
pub(in crate::synthesis) fn entries<T: Float>(matrix: &Matrix<f64>) -> Vec<T> {
    T::list(matrix.as_slice())
}
