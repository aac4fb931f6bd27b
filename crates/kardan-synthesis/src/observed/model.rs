//! The models that observers run: the linear one, and the full one.

use kardan_rt::{ModelObserver, Sensor, StateSpace};

use super::estimated_view::EstimatedView;
use super::reading::{Reading, sensor_table, sensors};
use crate::matrix_parts::column_range;
use crate::sampled::{entries, sensors_in};
use crate::{Law, Plant, SynthesisError};
use kardan_math::num::{Float, Matrix};
use kardan_mechanics::reduce::MechanismData;

/// The model of an observer.
#[derive(Clone)]
pub(super) enum Model<T> {
    /// The linear model at the operating point.
    Linear(LinearModelBlock<T>),
    Nonlinear(Box<FullModel<T>>),
}

impl<T: Float> Model<T> {
    /// The right side of the observer's equation: rates, or the state at the next sample, of matrices or tables for that. Returns
    /// whether it is finite.
    pub fn states(&mut self, states: &[f64], torques: &[f64], view: &EstimatedView, out: &mut [f64]) -> bool {
        match self {
            Self::Linear(linear) => linear.states(states, torques, view, out),
            Self::Nonlinear(full) => full.states(states, torques, &view.values, out),
        }
    }
}

/// The observer's block [`ModelObserver`] with the memory of one evaluation.
#[derive(Clone)]
pub(super) struct FullModel<T> {
    pub data: MechanismData<T>,
    inputs: Vec<usize>,
    sensors: Vec<Sensor<T>>,
    entries: Vec<(usize, T)>,
    disturbances: Vec<usize>,
    gain: Vec<T>,
    /// Γ of a sample time; none in continuous time.
    zoh_integral: Vec<T>,
    pub friction_width: Option<T>,
    memory: Vec<T>,
    torques: Vec<T>,
    readings: Vec<T>,
    state: Vec<T>,
    result: Vec<T>,
}

impl FullModel<f64> {
    pub fn new(
        law: &dyn Law,
        plant: &Plant,
        readings: &[Reading],
        disturbances: &[usize],
        gain: &Matrix<f64>,
    ) -> Result<Self, SynthesisError> {
        let number = |name: &String| plant.input(name).expect("a law commands inputs");
        let (sensors, terms) = sensors(readings);
        let states = gain.rows();
        let mut out = Self {
            data: MechanismData::new(&plant.reduced),
            inputs: law.inputs().iter().map(number).collect(),
            torques: vec![0.0; law.inputs().len()],
            readings: vec![0.0; sensors.len()],
            sensors,
            entries: terms,
            disturbances: disturbances.to_vec(),
            gain: entries(gain),
            zoh_integral: Vec::new(),
            friction_width: law.friction_width(),
            memory: Vec::new(),
            state: vec![0.0; states],
            result: vec![0.0; states],
        };
        out.memory = vec![0.0; out.block().memory()];
        Ok(out)
    }

    /// How the rates change with the state and with `[u; y]`, at rest at a position: central differences.
    pub fn slopes(&self, position: &[f64], readings: &[f64]) -> [Matrix<f64>; 2] {
        let mut full = self.clone();
        let (n, m, r) = (self.state.len(), self.inputs.len(), position.len());
        let mut at: Vec<f64> = position.to_vec();
        at.resize(n + m, 0.0);
        at.extend_from_slice(readings);
        let mut rates = |at: &[f64]| {
            let mut out = vec![0.0; n];
            full.states(&at[..n], &at[n..n + m], &at[n + m..], &mut out);
            out
        };
        let mut slopes = Matrix::zeros(n, at.len());
        for j in 0..at.len() {
            // The model is nonlinear in angles and, over the width of friction, in speeds; all else is linear.
            let step = match (j, self.friction_width) {
                (j, Some(width)) if j >= r => (SLOPE_STEP * width).min(SLOPE_STEP),
                _ => SLOPE_STEP,
            };
            let middle = at[j];
            at[j] = middle + step;
            let above = rates(&at);
            at[j] = middle - step;
            let below = rates(&at);
            at[j] = middle;
            (0..n).for_each(|i| slopes[(i, j)] = (above[i] - below[i]) / (2.0 * step));
        }
        [column_range(&slopes, 0..n), column_range(&slopes, n..at.len())]
    }

    /// The same in a precision, for a sample time with that Γ.
    pub fn cast<T: Float>(&self, zoh_integral: &Matrix<f64>) -> FullModel<T> {
        let (sensors, terms) = sensors_in(&self.sensors, &self.entries);
        FullModel {
            data: self.data.cast(T::from_f64),
            inputs: self.inputs.clone(),
            sensors,
            entries: terms,
            disturbances: self.disturbances.clone(),
            gain: T::list(&self.gain),
            zoh_integral: entries(zoh_integral),
            friction_width: self.friction_width.map(T::from_f64),
            memory: T::list(&self.memory),
            torques: T::list(&self.torques),
            readings: T::list(&self.readings),
            state: T::list(&self.state),
            result: T::list(&self.result),
        }
    }

    /// The tables and lists of the block for a file, in addition to those of the mechanism.
    pub fn tables(&self) -> Vec<(String, Vec<Vec<f64>>)> {
        let numbers = |list: &[usize]| list.iter().map(|k| vec![*k as f64]).collect::<Vec<_>>();
        let gain = self.gain.chunks(self.sensors.len().max(1)).map(<[f64]>::to_vec).collect();
        let own = [
            ("commanded", numbers(&self.inputs)),
            ("sensors", sensor_table(&self.sensors)),
            ("sensor_entries", self.entries.iter().map(|(shaft, x)| vec![*shaft as f64, *x]).collect()),
            ("disturbances", numbers(&self.disturbances)),
            ("gain", gain),
        ];
        let own = own.into_iter().map(|(name, rows)| (name.to_string(), rows));
        self.data.tables(|x| x).into_iter().chain(own).collect()
    }
}

/// Step of central differences, rad, rad/s or N m.
const SLOPE_STEP: f64 = 1e-5;

impl<T: Float> FullModel<T> {
    fn block(&self) -> ModelObserver<'_, T> {
        ModelObserver {
            mechanism: self.data.block(),
            inputs: &self.inputs,
            sensors: &self.sensors,
            entries: &self.entries,
            disturbances: &self.disturbances,
            gain: &self.gain,
            zoh_integral: &self.zoh_integral,
            friction_width: self.friction_width,
        }
    }

    fn states(&mut self, states: &[f64], torques: &[f64], readings: &[f64], out: &mut [f64]) -> bool {
        T::narrow(states, &mut self.state);
        T::narrow(torques, &mut self.torques);
        T::narrow(readings, &mut self.readings);
        let (state, mut result) = (std::mem::take(&mut self.state), std::mem::take(&mut self.result));
        let mut memory = std::mem::take(&mut self.memory);
        let found = if self.zoh_integral.is_empty() {
            self.block().rates(&state, &self.torques, &self.readings, &mut memory, &mut result)
        } else {
            result.copy_from_slice(&state);
            self.block().step(&mut result, &self.torques, &self.readings, &mut memory)
        };
        T::widen(&result, out);
        (self.memory, self.state, self.result) = (memory, state, result);
        found
    }
}

/// The values of an observer's states and of the torques at an operating point.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct RestOfModel {
    pub states: Vec<f64>,
    pub torques: Vec<f64>,
}

impl RestOfModel {
    /// Those of a plant, for these inputs, with what the states are over `[q_r; q̇_r]` before all others; `None` at zero without torques.
    pub fn of(plant: &Plant, inputs: &[String], measured: &Matrix<f64>, all: usize) -> Option<Self> {
        let point = &plant.point;
        let at_rest = || point.position.iter().chain(&point.rates);
        let state = |i: usize| measured.row(i).iter().zip(at_rest()).map(|(x, rest)| x * rest).sum();
        let mut states: Vec<f64> = (0..measured.rows()).map(state).collect();
        states.resize(all, 0.0);
        let torques = inputs.iter().map(|input| plant.trim_torque(input)).collect();
        plant.is_moved().then_some(Self { states, torques })
    }
}

/// The observer's block [`StateSpace`] with the memory of one evaluation.
#[derive(Clone)]
pub(super) struct LinearModelBlock<T> {
    a: Vec<T>,
    b: Vec<T>,
    signals: Vec<T>,
    state: Vec<T>,
    result: Vec<T>,
    /// Its values at rest.
    pub rest: Option<RestOfModel>,
    /// Whether it gives the states at the next sample instead of rates.
    steps: bool,
}

impl<T: Float> LinearModelBlock<T> {
    pub fn new(a: &Matrix<f64>, b: &Matrix<f64>, rest: Option<RestOfModel>, steps: bool) -> Self {
        let zeros = |count: usize| vec![T::ZERO; count];
        Self {
            a: entries(a),
            b: entries(b),
            signals: zeros(b.columns()),
            state: zeros(a.rows()),
            result: zeros(a.rows()),
            rest,
            steps,
        }
    }

    /// `A x̂ + B [u; y]`; the readings are those that the view has taken. Returns whether these are numbers; if not, it writes nothing.
    fn states(&mut self, states: &[f64], torques: &[f64], view: &EstimatedView, out: &mut [f64]) -> bool {
        let (inputs, readings) = self.signals.split_at_mut(torques.len());
        T::narrow(torques, inputs);
        for ((signal, value), offset) in readings.iter_mut().zip(&view.values).zip(&view.offsets) {
            *signal = T::from_f64(value - offset);
        }
        T::narrow(states, &mut self.state);
        if let Some(rest) = &self.rest {
            let less = |values: &mut [T], of: &[f64], rest: &[f64]| {
                let all = values.iter_mut().zip(of.iter().zip(rest));
                all.for_each(|(value, (x, rest))| *value = T::from_f64(x - rest));
            };
            less(inputs, torques, &rest.torques);
            less(&mut self.state, states, &rest.states);
        }
        let Some(block) = StateSpace::new(&self.a, &self.b, &[], &[], self.state.len(), self.signals.len()) else {
            unreachable!("the matrices fit each other by construction");
        };
        let found = block.rates(&self.state, &self.signals, &mut self.result);
        T::widen(&self.result, out);
        if let Some(rest) = self.rest.as_ref().filter(|_| self.steps) {
            out.iter_mut().zip(&rest.states).for_each(|(state, rest)| *state += rest);
        }
        found
    }
}
