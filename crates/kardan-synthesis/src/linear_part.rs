//! The linear part of a law.

use crate::matrix_parts::{column_range, selected, side_by_side};
use kardan_math::num::{LastDigits, Matrix, Rational, Scalar, discretise, rational_from_f64, rational_to_f64, rows_of};

/// The linear part of a law, `ξ̇ = A ξ + Bφ φ + Bω ω + Bδ δ + Bτ τ + Bρ ρ`, `u = C ξ + Dφ φ + Dω ω + Dδ δ + Dρ ρ`, over the
/// angles φ and speeds ω of all shafts, the disturbance torques δ, the torques τ of its own inputs and its references ρ.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearLaw<S = f64> {
    /// A, states × states.
    pub states: Matrix<S>,
    /// Bφ, states × shafts.
    pub angles: Matrix<S>,
    /// Bω, states × shafts.
    pub speeds: Matrix<S>,
    /// Bδ, states × disturbances.
    pub disturbances: Matrix<S>,
    /// Bτ, states × inputs.
    pub torques: Matrix<S>,
    /// C, inputs × states.
    pub on_states: Matrix<S>,
    /// Dφ, inputs × shafts.
    pub on_angles: Matrix<S>,
    /// Dω, inputs × shafts.
    pub on_speeds: Matrix<S>,
    /// Dδ, inputs × disturbances.
    pub on_disturbances: Matrix<S>,
    /// Bρ, states × references.
    pub references: Matrix<S>,
    /// Dρ, inputs × references.
    pub on_references: Matrix<S>,
    /// How errors of the readings of [`Law::sensors`](super::Law::sensors) act on the states in addition to true angles and speeds, states ×
    /// sensors.
    pub errors: Matrix<S>,
    /// How they act on the commands, inputs × sensors.
    pub on_errors: Matrix<S>,
    /// Whether the states of a sampled law follow their differential equations between its samples, as those of blocks without a sample time do; else
    /// they change at its samples. Without meaning for a law in continuous time.
    pub flowing: bool,
}

impl<S: Scalar> LinearLaw<S> {
    /// A law without states and without disturbance inputs.
    pub fn gains(on_angles: Matrix<S>, on_speeds: Matrix<S>, on_references: Matrix<S>) -> Self {
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

    /// The same with other entries.
    pub(super) fn map<T: Scalar>(&self, entry: &mut dyn FnMut(&S) -> T) -> LinearLaw<T> {
        let mut of = |matrix: &Matrix<S>| {
            let entries: Vec<T> = matrix.as_slice().iter().map(&mut *entry).collect();
            Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| entries[i * matrix.columns() + j].clone())
        };
        LinearLaw {
            states: of(&self.states),
            angles: of(&self.angles),
            speeds: of(&self.speeds),
            disturbances: of(&self.disturbances),
            torques: of(&self.torques),
            on_states: of(&self.on_states),
            on_angles: of(&self.on_angles),
            on_speeds: of(&self.on_speeds),
            on_disturbances: of(&self.on_disturbances),
            references: of(&self.references),
            on_references: of(&self.on_references),
            errors: of(&self.errors),
            on_errors: of(&self.on_errors),
            flowing: self.flowing,
        }
    }

    /// All its numbers.
    fn entries(&self) -> impl Iterator<Item = &S> {
        let of_states = [&self.states, &self.angles, &self.speeds, &self.disturbances, &self.torques];
        let of_commands = [&self.on_states, &self.on_angles, &self.on_speeds, &self.on_disturbances];
        let feedthrough = [&self.references, &self.on_references, &self.errors, &self.on_errors];
        of_states.into_iter().chain(of_commands).chain(feedthrough).flat_map(|matrix| matrix.as_slice())
    }

    /// Some of its commands and states, with some of its sensors.
    pub(super) fn part(&self, [commands, states, sensors]: [&[usize]; 3]) -> Self {
        Self {
            states: selected(&self.states, states, states),
            angles: rows_of(&self.angles, states),
            speeds: rows_of(&self.speeds, states),
            disturbances: rows_of(&self.disturbances, states),
            torques: selected(&self.torques, states, commands),
            on_states: selected(&self.on_states, commands, states),
            on_angles: rows_of(&self.on_angles, commands),
            on_speeds: rows_of(&self.on_speeds, commands),
            on_disturbances: rows_of(&self.on_disturbances, commands),
            references: rows_of(&self.references, states),
            on_references: rows_of(&self.on_references, commands),
            errors: selected(&self.errors, states, sensors),
            on_errors: selected(&self.on_errors, commands, sensors),
            flowing: self.flowing,
        }
    }
}

impl LinearLaw<Rational> {
    /// Whether a number of it is rounded.
    pub fn is_rounded(&self) -> bool {
        self.entries().any(LastDigits::is_rounded)
    }

    /// The same with other numbers in place of rounded ones, within this rounding where it is not zero, else within their last digits.
    #[must_use]
    pub fn near(&self, rounding: Option<&LinearLaw>, digits: &mut LastDigits) -> Self {
        let mut all = rounding.into_iter().flat_map(LinearLaw::entries);
        self.map(&mut |x| match all.next() {
            Some(rounding) if *rounding > 0.0 => digits.perturbed(x, *rounding),
            _ => digits.near(x),
        })
    }

    /// Its numbers rounded.
    pub fn to_f64(&self) -> LinearLaw {
        self.map(&mut rational_to_f64)
    }
}

impl LinearLaw {
    /// Whether all its numbers are finite.
    pub fn is_finite(&self) -> bool {
        self.entries().all(|x| x.is_finite())
    }

    /// The fractions that its numbers are.
    pub fn exact(&self) -> LinearLaw<Rational> {
        self.map(&mut |x| rational_from_f64(*x).unwrap_or_default())
    }

    /// Whether all entries are finite in single precision, in which firmware runs.
    pub fn fits_single(&self) -> bool {
        let on_plant = [&self.angles, &self.speeds, &self.disturbances, &self.torques, &self.references];
        let commands = [&self.on_angles, &self.on_speeds, &self.on_disturbances, &self.on_references];
        let mut all = on_plant.into_iter().chain(commands).chain([&self.states, &self.on_states]);
        all.all(|matrix| matrix.as_slice().iter().all(|x| (*x as f32).is_finite()))
    }

    /// The entries that are larger than the last digits of these values, others as zero; `None` if there is none.
    pub(super) fn beyond_last_digits(&self, values: &Self) -> Option<Self> {
        let mut values = values.entries();
        let mut beyond = |rounding: &f64| {
            let value = values.next().expect("as many numbers");
            if *rounding > LastDigits::of(*value) { *rounding } else { 0.0 }
        };
        Some(self.map(&mut beyond)).filter(|rounding| rounding.entries().any(|x| *x != 0.0))
    }

    /// The sizes of all its entries.
    pub(super) fn sizes(&self) -> Self {
        self.map(&mut |x| x.abs())
    }

    /// The law discretised at a sample time, with zero-order hold of its signals; `None` if a number overflows.
    pub(super) fn sampled(&self, period: f64) -> Option<Self> {
        if self.states.rows() == 0 {
            return Some(self.clone());
        }
        let parts = [&self.angles, &self.speeds, &self.disturbances, &self.torques, &self.references, &self.errors];
        let found = discretise(&self.states, &side_by_side(&parts), period)?;
        let mut first = 0;
        let [angles, speeds, disturbances, torques, references, errors] = parts.map(|part| {
            let start = first;
            first += part.columns();
            column_range(&found.b, start..first)
        });
        Some(Self { states: found.a, angles, speeds, disturbances, torques, references, errors, ..self.clone() })
    }
}

/// The absolute values of all entries.
pub(super) fn sizes(matrix: &Matrix<f64>) -> Matrix<f64> {
    Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| matrix[(i, j)].abs())
}
