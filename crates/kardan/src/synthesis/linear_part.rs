//! The linear part of a law.

use crate::num::{LastDigits, Matrix, discretise, rational_from_f64};

/// The linear part of a law, `ξ̇ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ + Bρ ρ`, `u = C ξ + Dφ φ + Dω ω + Dδ δ + Dρ ρ`, over the
/// angles φ and speeds ω of all shafts, the disturbance torques δ, the torques τ of its own inputs and its references ρ.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearLaw {
    /// A, states × states.
    pub states: Matrix<f64>,
    /// Bφ, states × shafts.
    pub angles: Matrix<f64>,
    /// Bω, states × shafts.
    pub speeds: Matrix<f64>,
    /// Bδ, states × disturbances.
    pub disturbances: Matrix<f64>,
    /// Bτ, states × inputs.
    pub torques: Matrix<f64>,
    /// C, inputs × states.
    pub on_states: Matrix<f64>,
    /// Dφ, inputs × shafts.
    pub on_angles: Matrix<f64>,
    /// Dω, inputs × shafts.
    pub on_speeds: Matrix<f64>,
    /// Dδ, inputs × disturbances.
    pub on_disturbances: Matrix<f64>,
    /// Bρ, states × references.
    pub references: Matrix<f64>,
    /// Dρ, inputs × references.
    pub on_references: Matrix<f64>,
    /// How errors of the readings of [`Law::sensors`](super::Law::sensors) act on the states beside what follows from true angles and speeds, states ×
    /// sensors.
    pub errors: Matrix<f64>,
    /// How they act on the commands, inputs × sensors.
    pub on_errors: Matrix<f64>,
    /// Whether the states of a sampled law follow their differential equations between its samples, as those of blocks without a sample time do; else
    /// they change at its samples. Without meaning for a law in continuous time.
    pub flowing: bool,
}

impl LinearLaw {
    /// A law without states that is told no disturbances.
    pub fn gains(on_angles: Matrix<f64>, on_speeds: Matrix<f64>, on_references: Matrix<f64>) -> Self {
        let (inputs, shafts) = (on_angles.rows(), on_angles.columns());
        Self {
            states: Matrix::zeros(0, 0),
            angles: Matrix::zeros(0, shafts),
            speeds: Matrix::zeros(0, shafts),
            disturbances: Matrix::zeros(0, 0),
            torques: Matrix::zeros(0, inputs),
            on_states: Matrix::zeros(inputs, 0),
            on_angles,
            on_speeds,
            on_disturbances: Matrix::zeros(inputs, 0),
            references: Matrix::zeros(0, on_references.columns()),
            on_references,
            errors: Matrix::zeros(0, 0),
            on_errors: Matrix::zeros(inputs, 0),
            flowing: false,
        }
    }

    /// All its matrices.
    fn matrices(&mut self) -> [&mut Matrix<f64>; 13] {
        let of_states =
            [&mut self.states, &mut self.angles, &mut self.speeds, &mut self.disturbances, &mut self.torques];
        let [a, b, c, d, e] = of_states;
        let on = [&mut self.on_states, &mut self.on_angles, &mut self.on_speeds, &mut self.on_disturbances];
        let [f, g, h, i] = on;
        let [j, k, l, m] = [&mut self.references, &mut self.on_references, &mut self.errors, &mut self.on_errors];
        [a, b, c, d, e, f, g, h, i, j, k, l, m]
    }

    /// Whether a number of it is rounded.
    pub fn is_rounded(&self) -> bool {
        let rounded = |x: &f64| rational_from_f64(*x).is_some_and(|exact| LastDigits::is_rounded(&exact));
        self.clone().matrices().into_iter().any(|matrix| matrix.as_slice().iter().any(rounded))
    }

    /// The same with other numbers in place of rounded ones, within their last digits.
    #[must_use]
    pub fn near(&self, digits: &mut LastDigits) -> Self {
        let mut out = self.clone();
        for matrix in out.matrices() {
            let near: Vec<f64> = matrix.as_slice().iter().map(|x| digits.near_double(*x)).collect();
            *matrix = Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| near[i * matrix.columns() + j]);
        }
        out
    }

    /// Whether all entries are finite in single precision, in which firmware runs.
    pub fn fits_single(&self) -> bool {
        let on_plant = [&self.angles, &self.speeds, &self.disturbances, &self.torques, &self.references];
        let commands = [&self.on_angles, &self.on_speeds, &self.on_disturbances, &self.on_references];
        let mut all = on_plant.into_iter().chain(commands).chain([&self.states, &self.on_states]);
        all.all(|matrix| matrix.as_slice().iter().all(|x| (*x as f32).is_finite()))
    }

    /// The sizes of all its entries.
    pub(super) fn sizes(&self) -> Self {
        Self {
            states: sizes(&self.states),
            angles: sizes(&self.angles),
            speeds: sizes(&self.speeds),
            disturbances: sizes(&self.disturbances),
            torques: sizes(&self.torques),
            on_states: sizes(&self.on_states),
            on_angles: sizes(&self.on_angles),
            on_speeds: sizes(&self.on_speeds),
            on_disturbances: sizes(&self.on_disturbances),
            references: sizes(&self.references),
            on_references: sizes(&self.on_references),
            errors: sizes(&self.errors),
            on_errors: sizes(&self.on_errors),
            flowing: self.flowing,
        }
    }

    /// The law with its states at a sample time, its signals held in between; `None` if a number overflows.
    pub(super) fn held(&self, period: f64) -> Option<Self> {
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

/// The absolute values of all entries.
pub(super) fn sizes(matrix: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)].abs())
}

/// Matrices with the same number of rows beside each other.
pub(super) fn side_by_side(parts: &[&Matrix<f64>]) -> Matrix<f64> {
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
