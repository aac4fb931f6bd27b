//! Laws with observers.

mod block;
mod estimated_view;
mod gain;
mod keys;
mod model;
mod reading;

pub(super) use gain::{distinguishable_torques, noise};
pub use keys::Observer;
pub(super) use keys::disturbances;
pub(super) use reading::{Reading, reading, rows, sensor_table, sensors};

use std::sync::Arc;

use super::counters::{ReducedStates, acts_by, counters_beside};
use super::matrix_parts::{column_range, joined, side_by_side, spread, stacked};
use super::observer::extend;
use super::{Block, Clock, ExactLoop, Law, LinearLaw, Plant, Reference, SynthesisError};
use block::ObserverBlock;
use estimated_view::EstimatedView;
use gain::gain;
use kardan_analysis::{LinearSystem, OutputSignal};
use kardan_math::names::backquoted;
use kardan_math::num::{Float, Matrix, discretise};
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{ControllerData, DataMatrix, DataNumber, Design, ObserverResult, ReadSignal};
use kardan_schema::schema::Values;
use model::{FullModel, LinearModelBlock, Model, RestOfModel};

/// A law with an observer of the plant: angles and speeds that are not measured, and disturbances, are estimates.
///
/// `x̂′ = A x̂ + B u + L (y − C x̂)` over reduced coordinates, their speeds and disturbance torques, \[diss. (6.45), (6.46)\], run
/// by the block [`StateSpace`] with the signals `[u; y]`; or the nonlinear model in place of A, B and C, run by the block
/// [`ModelObserver`]. Charges on which neither plant nor sensors nor law depend are left out; the nonlinear model counts them on.
pub(super) struct Observed {
    law: Arc<dyn Law>,
    result: ObserverResult,
    data: ControllerData,
    sensors: Vec<OutputSignal>,
    a: Matrix<f64>,
    b: Matrix<f64>,
    /// Rows of the sensors over angles and speeds of all shafts.
    rows: [Matrix<f64>; 2],
    basis: Matrix<f64>,
    disturbances: usize,
    /// As they are at the start of a run.
    view: EstimatedView,
    model: Model<f64>,
}

impl Observed {
    /// Puts the observer that the keys ask for before a law.
    ///
    /// # Errors
    /// If the sensors do not show the required estimates, or the poles do not fit.
    pub fn new(law: Arc<dyn Law>, values: &Values, plant: &Plant, disturbed: &[usize]) -> Result<Self, SynthesisError> {
        let compensation = compensation(values)?;
        let nonlinear = is_nonlinear(&*law, values, plant, compensation > 0.0 && !disturbed.is_empty())?;
        let sensors: Vec<OutputSignal> = values
            .names("sensors")
            .unwrap_or_default()
            .iter()
            .map(|name| plant.output(name))
            .collect::<Result<_, _>>()?;
        let readings: Vec<Reading> = sensors.iter().map(|sensor| reading(sensor, plant)).collect::<Result<_, _>>()?;
        let inputs = law.inputs().to_vec();
        let system = plant.system(&inputs, &sensors);
        let (torques, _) = plant.torques(disturbed, &[]);
        let names: Vec<String> = disturbed.iter().map(|&k| plant.coordinates()[k].clone()).collect();
        let states: Vec<String> = names.iter().map(|name| Quantity::Disturbance.of(name)).collect();
        let reduction = needed(&*law, plant, &system);
        let reduced_system = extend(&reduction.system(&system), &reduction.columns(&torques), &states);
        let (gain, poles, notes) = gain(values, &reduced_system)?;
        let floating = Matrix::from_fn(gain.values.len(), sensors.len(), |i, j| gain.values[i][j]);
        let all = system.states.len();
        let (reduction, extended, floating) = match nonlinear && reduction.retained.len() < all {
            true => (
                ReducedStates::all(all),
                extend(&system, &torques, &states),
                over_all(&floating, &reduction.retained, all),
            ),
            false => (reduction, reduced_system, floating),
        };
        let (a, b, c) = (extended.a.to_f64(), extended.b.to_f64(), extended.c.to_f64());
        let correction = floating.multiply(&c);
        let a = Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] - correction[(i, j)]);
        let b = side_by_side(&[&b, &floating]);
        let mut sentences = distinguishable_torques(plant, &system, &reduction)?;
        sentences.extend(notes);
        let method = values.word("method").unwrap_or("poles").to_string();
        let result = ObserverResult {
            sensors: sensors.iter().map(|sensor| sensor.name.clone()).collect(),
            states: extended.states.clone(),
            disturbances: names,
            poles,
            method,
            gain,
            distinguishable: sentences,
        };
        let rows = rows(&readings, plant.coordinates().len());
        let places = plant.state_places();
        let retained = reduction.retained.iter().map(|k| places[*k]).collect();
        let measured = plant.over_motions(&reduction.projection).to_f64();
        let view = EstimatedView::new(readings, plant, compensation, (retained, measured), disturbed.len());
        let model = if nonlinear {
            Model::Nonlinear(Box::new(FullModel::new(&*law, plant, &view.readings, disturbed, &floating)?))
        } else {
            Model::Linear(LinearModelBlock::new(
                &a,
                &b,
                RestOfModel::of(plant, &inputs, &view.measured, a.rows()),
                false,
            ))
        };
        let mut out = Self {
            data: ControllerData::default(),
            rows,
            sensors,
            basis: plant.linear.basis.to_f64(),
            disturbances: disturbed.len(),
            model,
            view,
            a,
            b,
            law,
            result,
        };
        out.data = out.observer_data(plant, &inputs);
        Ok(out)
    }

    fn observer_data(&self, plant: &Plant, inputs: &[String]) -> ControllerData {
        let torques = inputs.iter().map(|input| plant.effort_of(input));
        let sensors = self.result.sensors.iter().map(|name| ReadSignal::new(name, SignalName::new(name).unit()));
        let data = ControllerData {
            reads: torques.chain(sensors).collect(),
            writes: self.result.states.clone(),
            ..ControllerData::default()
        };
        let compensation = DataNumber::new("compensation", self.view.compensation);
        if let Model::Nonlinear(full) = &self.model {
            let tables = full.tables().into_iter().chain([("error".to_string(), self.a.to_rows())]);
            let numbers = [DataNumber::new("shafts", full.data.shafts.len() as f64), compensation];
            let width = full.friction_width.map(|width| DataNumber::new("friction_width", width));
            return ControllerData {
                block: "ModelObserver".into(),
                matrices: tables.map(|(name, rows)| DataMatrix::new(name, rows)).collect(),
                numbers: numbers.into_iter().chain(width).collect(),
                ..data
            };
        }
        let (n, signals) = (self.a.rows(), self.b.columns());
        let (identity, zeros) = (Matrix::identity(n), Matrix::zeros(n, signals));
        let matrices = [("A", &self.a), ("B", &self.b), ("C", &identity), ("D", &zeros)];
        let offsets = self.result.sensors.iter().zip(&self.view.offsets);
        let offsets = offsets.map(|(name, x)| DataNumber::new(format!("{name} offset"), *x));
        let rest = self.data_at_rest(plant, inputs);
        ControllerData {
            block: "StateSpace".into(),
            matrices: matrices.into_iter().map(|(name, matrix)| DataMatrix::new(name, matrix.to_rows())).collect(),
            numbers: std::iter::once(compensation).chain(offsets).chain(rest).collect(),
            ..data
        }
    }

    /// States and torques at the operating point, for a file.
    fn data_at_rest(&self, plant: &Plant, inputs: &[String]) -> Vec<DataNumber> {
        let Model::Linear(linear) = &self.model else { return Vec::new() };
        let named = |rest: &RestOfModel| -> Vec<DataNumber> {
            let states = self.result.states.iter().cloned().zip(rest.states.iter().copied());
            let torques = inputs.iter().map(|input| plant.effort_of(input).signal).zip(rest.torques.iter().copied());
            states.chain(torques).map(|(name, rest)| DataNumber::new(format!("{name} at rest"), rest)).collect()
        };
        linear.rest.as_ref().map(named).unwrap_or_default()
    }

    /// Γ = ∫ exp((A − L C) t) dt over a sample time.
    fn zoh_integral(&self, clock: Clock) -> Option<Matrix<f64>> {
        Some(discretise(&self.a, &Matrix::identity(self.a.rows()), clock.period)?.b)
    }

    /// For each coordinate whether its position or its speed is measured.
    fn measured(&self, speed: bool) -> Vec<bool> {
        let of = |reading: &Reading, shaft: usize| reading.speed == speed && reading.shaft == Some(shaft);
        let any = |shaft: &usize| self.view.readings.iter().any(|reading| of(reading, *shaft));
        self.view.coordinates.iter().map(any).collect()
    }

    /// The linear part of an observer `x̂′ = A x̂ + B [u; y]`, or of its sampled form, around that of a law.
    /// `basis`: K of the model where it is linear.
    fn with_observer(&self, a: &Matrix<f64>, b: &Matrix<f64>, law: &LinearLaw, basis: &Matrix<f64>) -> LinearLaw {
        let (n, k, shafts) = (a.rows(), law.states.rows(), basis.rows());
        let (r, m) = (self.view.coordinates.len(), law.on_angles.rows());
        // How angles and speeds that the law reads follow from estimates and from true ones: measured coordinates are true.
        let [true_angles, true_speeds] = [self.measured(false), self.measured(true)];
        let (retained, coordinates, readings) = (&self.view.retained, &self.view.coordinates, &self.view.readings);
        let split = |on_angles: &Matrix<f64>, on_speeds: &Matrix<f64>, on_disturbances: &Matrix<f64>| {
            let (rows, over_q, over_w) = (on_angles.rows(), on_angles.multiply(basis), on_speeds.multiply(basis));
            let known = on_disturbances.columns().min(self.disturbances);
            let on_estimates = Matrix::from_fn(rows, n, |i, at| match retained.get(at) {
                Some(&k) if k < r => unless(true_angles[k], over_q[(i, k)]),
                Some(&k) => unless(true_speeds[k - r], over_w[(i, k - r)]),
                None if at - retained.len() < known => {
                    self.view.compensation * on_disturbances[(i, at - retained.len())]
                }
                None => 0.0,
            });
            let only_true = |of: &Matrix<f64>, is_true: &[bool]| {
                spread(&Matrix::from_fn(rows, r, |i, j| unless(!is_true[j], of[(i, j)])), coordinates, shafts)
            };
            let (angles, speeds) = (only_true(&over_q, &true_angles), only_true(&over_w, &true_speeds));
            // Measured coordinates pass to the law with their errors.
            let place = |shaft: usize| coordinates.iter().position(|coordinate| *coordinate == shaft);
            let errors = Matrix::from_fn(rows, readings.len(), |i, j| {
                let over = if readings[j].speed { &over_w } else { &over_q };
                readings[j].shaft.and_then(place).map_or(0.0, |k| over[(i, k)])
            });
            (on_estimates, angles, speeds, errors)
        };
        let (command_estimates, on_angles, on_speeds, on_errors) =
            split(&law.on_angles, &law.on_speeds, &law.on_disturbances);
        let (rate_estimates, angles, speeds, errors) = split(&law.angles, &law.speeds, &law.disturbances);
        let correct = column_range(b, m..m + readings.len());
        LinearLaw {
            states: joined([a, &Matrix::zeros(n, k)], [&rate_estimates, &law.states]),
            angles: stacked(&[&correct.multiply(&self.rows[0]), &angles]),
            speeds: stacked(&[&correct.multiply(&self.rows[1]), &speeds]),
            disturbances: Matrix::zeros(n + k, 0),
            torques: stacked(&[&column_range(b, 0..m), &law.torques]),
            on_states: side_by_side(&[&command_estimates, &law.on_states]),
            on_angles,
            on_speeds,
            on_disturbances: Matrix::zeros(m, 0),
            references: stacked(&[&Matrix::zeros(n, law.references.columns()), &law.references]),
            on_references: law.on_references.clone(),
            errors: stacked(&[&correct, &errors]),
            on_errors,
            flowing: law.flowing,
        }
    }
}

/// A number, but zero on a condition.
fn unless(is_zero: bool, x: f64) -> f64 {
    if is_zero { 0.0 } else { x }
}

/// Share of the estimated disturbances that the law cancels.
pub(super) fn compensation(values: &Values) -> Result<f64, SynthesisError> {
    match values.number("compensation").filter(|share| *share > 1.0) {
        Some(share) => {
            let message = format!("`compensation` is {share}: a law cannot cancel more than the whole disturbance");
            Err(SynthesisError::whole(message, "write a number from 0 to 1"))
        }
        None => Ok(values.number_or_default("compensation")),
    }
}

/// Whether the observer runs the nonlinear model; `cancels`: whether disturbances that it estimates are cancelled.
fn is_nonlinear(law: &dyn Law, values: &Values, plant: &Plant, cancels: bool) -> Result<bool, SynthesisError> {
    let friction = law.friction_width().is_some();
    // A linear gain knows such torques, linearised, and the full model here does not.
    let laws = if friction || law.on_full_model() { Vec::new() } else { plant.elements_with_laws() };
    let nonlinear = match values.word("plant") {
        Some(word) => word == "nonlinear",
        None => friction || (laws.is_empty() && !plant.is_linear()),
    };
    if nonlinear {
        plant.check_inertia()?;
    }
    if nonlinear && !laws.is_empty() && cancels {
        let message = format!(
            "the gain of the law includes the linearised torques that expressions give ({}), and the full model of the \
             observer does not: it would report them as disturbances, and they would be cancelled twice",
            backquoted(&laws)
        );
        return Err(SynthesisError::whole(message, "set `plant = \"linear\"` in the observer, or leave it out"));
    }
    let more = friction || (law.on_full_model() && !plant.is_linear());
    if more && !nonlinear && cancels {
        return Err(SynthesisError::whole(
            "the law cancels forces that the observer's linear model does not contain (of joints, rest angles or \
             friction); the observer would report them as disturbances, and they would be cancelled twice",
            "set `plant = \"nonlinear\"`, `disturbances = []` or `compensation = 0` in the observer, or design the law \
             on the linear model",
        ));
    }
    Ok(nonlinear)
}

/// The states of the plant that the observer needs: charges that only count are left out, unless the law acts by them.
fn needed(law: &dyn Law, plant: &Plant, system: &LinearSystem) -> ReducedStates {
    let acting = acts_by(law, &plant.linear.basis);
    ReducedStates::of(&counters_beside(plant, system, &acting), system.states.len())
}

/// A gain over states and disturbances, with rows of zeros for the states that are left out.
fn over_all(gain: &Matrix<f64>, retained: &[usize], all: usize) -> Matrix<f64> {
    let mut out = Matrix::zeros(gain.rows() + all - retained.len(), gain.columns());
    for i in 0..gain.rows() {
        let place = retained.get(i).copied().unwrap_or(all + i - retained.len());
        (0..gain.columns()).for_each(|j| out[(place, j)] = gain[(i, j)]);
    }
    out
}

impl Observed {
    /// The model at a sample time; `None` if a number overflows there.
    fn model_at<T: Float>(&self, clock: Clock) -> Option<Model<T>> {
        Some(match &self.model {
            Model::Linear(linear) => {
                let sampled = discretise(&self.a, &self.b, clock.period)?;
                Model::Linear(LinearModelBlock::new(&sampled.a, &sampled.b, linear.rest.clone(), true))
            }
            Model::Nonlinear(full) => Model::Nonlinear(Box::new(full.cast(&self.zoh_integral(clock)?))),
        })
    }
}

impl Law for Observed {
    forward! {
        law;
        fn inputs(&self) -> &[String];
        fn references(&self) -> &[Reference];
        fn references_at_rest(&self) -> Vec<f64>;
        fn friction_width(&self) -> Option<f64>;
        fn on_full_model(&self) -> bool;
        fn exact(&self) -> Option<ExactLoop>;
    }

    fn states(&self) -> Vec<String> {
        self.result.states.iter().map(|state| format!("estimate of {state}")).chain(self.law.states()).collect()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(self.a.rows());
        own.fill(0.0);
        for (i, state) in own.iter_mut().enumerate().take(self.view.retained.len()) {
            let begins = |k: usize| {
                self.view.coordinates.get(k).map_or_else(|| self.view.rate_at_rest(k), |&shaft| angles[shaft])
            };
            let shares = self.view.measured.row(i).iter().enumerate().filter(|(_, x)| **x != 0.0);
            *state = shares.map(|(k, x)| x * begins(k)).sum();
        }
        self.law.start(angles, speeds, rest);
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let (law, view) = (self.law.block(clock)?, self.view.clone());
        Some(match clock {
            None => Box::new(ObserverBlock { law, view, model: self.model.clone() }),
            Some(clock) if clock.single => Box::new(ObserverBlock { law, view, model: self.model_at::<f32>(clock)? }),
            Some(clock) => Box::new(ObserverBlock { law, view, model: self.model_at::<f64>(clock)? }),
        })
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        let sampled = discretise(&self.a, &self.b, clock.period)?;
        Some(self.with_observer(&sampled.a, &sampled.b, &self.law.linear_sampled(clock)?, &self.basis))
    }

    fn linear(&self) -> LinearLaw {
        self.with_observer(&self.a, &self.b, &self.law.linear(), &self.basis)
    }

    fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        let law = self.law.linear_at(position, clock)?;
        let (mut kinematics, r) = (self.view.kinematics.clone(), position.len());
        kinematics.update(position, &vec![0.0; r]);
        let basis = Matrix::from_fn(kinematics.angles.len(), r, |i, j| kinematics.basis[i * r + j]);
        let Model::Nonlinear(full) = &self.model else {
            let Some(clock) = clock else { return Some(self.with_observer(&self.a, &self.b, &law, &basis)) };
            let sampled = discretise(&self.a, &self.b, clock.period)?;
            return Some(self.with_observer(&sampled.a, &sampled.b, &law, &basis));
        };
        let read = |reading: &Reading| reading.read(&kinematics.angles, &kinematics.speeds);
        let readings: Vec<f64> = self.view.readings.iter().map(read).collect();
        let [a, b] = full.slopes(position, &readings);
        let Some(clock) = clock else { return Some(self.with_observer(&a, &b, &law, &basis)) };
        // x̂⁺ = x̂ + Γ x̂′
        let zoh_integral = self.zoh_integral(clock)?;
        let next = Matrix::identity(a.rows()).plus(&zoh_integral.multiply(&a));
        Some(self.with_observer(&next, &zoh_integral.multiply(&b), &law, &basis))
    }

    fn is_nonlinear(&self) -> bool {
        matches!(self.model, Model::Nonlinear(_)) || self.law.is_nonlinear()
    }

    fn describe(&self) -> Design {
        let mut design = self.law.describe();
        design.observer = Some(self.result.clone());
        design.observer_data = Some(self.data.clone());
        if matches!(self.model, Model::Nonlinear(_)) {
            design.notes.push(
                "the observer runs the full nonlinear model, with the gain for the operating point of the design (zero angles, where \
                 none is named); the poles of its error are those there"
                    .into(),
            );
        }
        design.notes.push(
            "the proof of the loop applies to the true state; the observer's error acts on the outputs until it has decayed".into(),
        );
        design
    }
}
