//! The linear plant of a sampled loop with its motors.

use std::sync::Arc;

use crate::observed::Reading;
use kardan_math::num::{Matrix, Rational};
use kardan_mechanics::assemble::{CoefficientKind as Kind, TermCoefficient};
use kardan_mechanics::equations::Sensor;
use kardan_mechanics::reduce::{FirstOrder, LinearModel, Reduced, reads_blocks};

/// A linear plant with its motors, in floating point: `H q̈ + D q̇ + S q = F τ`. Coordinates without inertia have a damping, and no rate as a state.
#[derive(Debug, Clone, PartialEq)]
pub struct LoopPlant {
    /// H, kg m².
    pub inertia: Matrix<f64>,
    /// D, N m s/rad.
    pub damping: Matrix<f64>,
    /// S, N m/rad.
    pub stiffness: Matrix<f64>,
    /// F, coordinates × inputs.
    pub input: Matrix<f64>,
    /// K, shafts × coordinates.
    pub basis: Matrix<f64>,
    /// Numbers of the coordinates that have an inertia, whose rates are states.
    pub moving: Vec<usize>,
    /// Names of the inputs.
    pub inputs: Vec<String>,
    /// Time constant of each input's motor, s; zero for an ideal one.
    pub lags: Vec<f64>,
    /// Sensors with a sample time of their own.
    pub slow_sensors: Vec<SlowSensor>,
    /// Its matrices before rounding, with the inputs in the same order, where they are known.
    pub exact: Option<Arc<LinearModel>>,
}

/// A sensor that reads at times of its own, from zero on, with zero-order hold of its reading.
#[derive(Debug, Clone, PartialEq)]
pub struct SlowSensor {
    /// Name.
    pub name: String,
    /// Time between two readings, s.
    pub period: f64,
    /// Its measured shaft and factor.
    pub row: Vec<(usize, f64)>,
    /// How it reads them.
    pub reads: Reads,
}

/// The output of a sensor over shafts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Reads {
    /// Their angles.
    Angles,
    /// Their speeds.
    Speeds,
    /// The difference of two angles over the time between.
    Differences,
}

impl SlowSensor {
    /// Its ideal reading, over angles and speeds.
    pub(super) fn true_rows(&self) -> [&[(usize, f64)]; 2] {
        if self.reads == Reads::Angles { [&self.row, &[]] } else { [&[], &self.row] }
    }

    fn of(name: &str, sensor: &Sensor, reduced: &Reduced) -> Option<Self> {
        let period = sensor.sample_time.as_ref()?.to_f64();
        let Reading { row, speed, .. } = Reading::of(&sensor.measured, reduced)?;
        let reads = match speed {
            true if sensor.resolution.is_some() => Reads::Differences,
            true => Reads::Speeds,
            false => Reads::Angles,
        };
        Some(Self { name: name.into(), period, row, reads })
    }
}

impl LoopPlant {
    /// The linear model with motors of these lags.
    ///
    /// # Panics
    /// If there is not one lag for each input.
    pub fn new(model: &LinearModel, lags: &[f64]) -> Self {
        assert_eq!(lags.len(), model.inputs.len(), "one lag for each input");
        Self {
            inertia: model.inertia.to_f64(),
            damping: model.damping.to_f64(),
            stiffness: model.stiffness.to_f64(),
            input: model.input.to_f64(),
            basis: model.basis.to_f64(),
            moving: model.moving(),
            inputs: model.inputs.clone(),
            lags: lags.to_vec(),
            slow_sensors: Vec::new(),
            exact: Some(Arc::new(model.clone())),
        }
    }

    /// `[q_r; q̇_m]` and its equations.
    ///
    /// # Panics
    /// If the inertia matrix is singular in more than coordinates that a damper determines.
    pub fn first_order(&self) -> FirstOrder<f64> {
        let matrices = [&self.inertia, &self.damping, &self.stiffness, &self.input];
        let found = FirstOrder::new(self.moving.clone(), matrices);
        found.expect("reduced inertia is positive definite")
    }

    /// How many states it has.
    pub fn states(&self) -> usize {
        self.inertia.rows() + self.moving.len()
    }

    /// The same with an input along each torque that follows from outputs of blocks, after those of the motors, by the name of its element.
    pub fn with_block_torques(mut self, reduced: &Reduced) -> Self {
        let laws: Vec<_> = reduced.equations.laws.iter().filter(|law| reads_blocks(&law.value)).collect();
        let Some(mut model) = self.exact.as_deref().cloned().filter(|_| !laws.is_empty()) else { return self };
        let own = model.input.columns();
        let column_entry = |i: usize, row: &[(usize, Rational)]| {
            row.iter().fold(Rational::ZERO, |sum, (shaft, x)| sum + x * &model.basis[(*shaft, i)])
        };
        model.input = Matrix::from_fn(model.input.rows(), own + laws.len(), |i, j| match j.checked_sub(own) {
            Some(law) => column_entry(i, &laws[law].row),
            None => model.input[(i, j)].clone(),
        });
        let names: Vec<String> = laws.iter().map(|law| law.element.clone()).collect();
        model.inputs.extend(names.iter().cloned());
        self.inputs.extend(names);
        self.lags.extend(laws.iter().map(|_| 0.0));
        self.input = model.input.to_f64();
        self.exact = Some(Arc::new(model));
        self
    }

    /// The same with the sensors of the file that have a sample time.
    pub fn with_sensors(mut self, reduced: &Reduced) -> Self {
        let all = reduced.equations.sensors.iter();
        self.slow_sensors = all.filter_map(|(name, sensor)| SlowSensor::of(name, sensor, reduced)).collect();
        self
    }
}

/// A linear plant whose coefficients vary: inertias, dampings and stiffnesses of its elements.
#[derive(Debug, Clone)]
pub struct VariedPlant {
    nominal: LoopPlant,
    /// The coefficients that vary, each with its row over the coordinates.
    terms: Vec<(TermCoefficient, Vec<f64>)>,
}

impl VariedPlant {
    /// The plant of a linear model, term by term.
    ///
    /// # Panics
    /// As [`LoopPlant::new`].
    pub fn new(reduced: &Reduced, model: &LinearModel, lags: &[f64]) -> Self {
        let nominal = LoopPlant::new(model, lags).with_sensors(reduced).with_block_torques(reduced);
        let basis = &nominal.basis;
        let row = |column_entry: &[(usize, f64)]| -> Vec<f64> {
            (0..basis.columns()).map(|j| column_entry.iter().map(|(shaft, x)| x * basis[(*shaft, j)]).sum()).collect()
        };
        let all = reduced.equations.coefficients().into_iter();
        let varied = all.filter(|one| one.kind != Kind::Friction && one.value != 0.0);
        Self { terms: varied.map(|one| (one.clone(), row(&one.row))).collect(), nominal }
    }

    /// Names of the coefficients: `fs.inertia`, `torsion_bar.stiffness`.
    pub fn names(&self) -> Vec<String> {
        self.terms.iter().map(|(one, _)| one.name.clone()).collect()
    }

    /// The coefficients, each with its number in `factors` of [`Self::at`].
    pub fn coefficients(&self) -> impl Iterator<Item = (usize, &TermCoefficient)> {
        self.terms.iter().map(|(one, _)| one).enumerate()
    }

    /// The plant as it is.
    pub fn nominal(&self) -> &LoopPlant {
        &self.nominal
    }

    /// The plant with each coefficient times a factor.
    pub fn at(&self, factors: &[f64]) -> LoopPlant {
        let mut out = LoopPlant { exact: None, ..self.nominal.clone() };
        for ((one, row), factor) in self.terms.iter().zip(factors) {
            let matrix = match one.kind {
                Kind::Inertia => &mut out.inertia,
                Kind::Damping => &mut out.damping,
                Kind::Stiffness => &mut out.stiffness,
                Kind::Friction => continue,
            };
            let change = one.value * (factor - 1.0);
            for i in 0..row.len() {
                (0..row.len()).for_each(|j| matrix[(i, j)] += change * row[i] * row[j]);
            }
        }
        out
    }
}
