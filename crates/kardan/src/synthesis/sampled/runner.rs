use kardan_rt::{Bounds, Gain, Governor, Health, Regulator, RegulatorMemory};

use super::{Block, entries, keep_health};
use crate::num::{Float, Keeper, Matrix};
use crate::synthesis::Seen;
use crate::synthesis::observed::Reading;

/// The numbers of the block [`Regulator`].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::synthesis) struct RegulatorData {
    pub prediction: Matrix<f64>,
    pub input: Matrix<f64>,
    pub output: Matrix<f64>,
    pub correction: Matrix<f64>,
    pub model: Matrix<f64>,
    pub model_input: Matrix<f64>,
    pub feedback: Matrix<f64>,
    pub bounds: Vec<Bounds<f64>>,
    pub governor: Option<GovernorData>,
}

/// The numbers of the block [`Governor`].
#[derive(Debug, Clone, PartialEq)]
pub(in crate::synthesis) struct GovernorData {
    /// Predictions × (states, states of the reference model, references).
    pub prediction: Matrix<f64>,
    /// N m
    pub bounds: Vec<f64>,
}

impl RegulatorData {
    /// States, states of the reference model, references, readings, commands.
    pub fn sizes(&self) -> [usize; 5] {
        let references = self.model_input.columns();
        [self.prediction.rows(), self.model.rows(), references, self.output.rows(), self.input.columns()]
    }
}

/// The block [`Regulator`] with its memory. Of a law's states it is estimate, reference model, last good readings, governed
/// references and commands, one after the other.
#[derive(Debug, Clone)]
pub(in crate::synthesis) struct Runner<T> {
    sizes: [usize; 5],
    prediction: Vec<T>,
    input: Vec<T>,
    output: Vec<T>,
    correction: Vec<T>,
    model: Vec<T>,
    model_input: Vec<T>,
    feedback: Vec<T>,
    bounds: Vec<Bounds<T>>,
    /// On state, on reference model, on references, bounds.
    governor: Option<[Vec<T>; 4]>,
    readings: Vec<Reading>,
    /// What the sensors read at zero coordinates.
    offsets: Vec<f64>,
    memory: Vec<T>,
    read: Vec<T>,
    told: Vec<T>,
    work: Vec<T>,
    health: Health,
}

impl<T: Float> Runner<T> {
    pub fn new(data: &RegulatorData, readings: &[Reading], offsets: &[f64]) -> Self {
        let sizes = data.sizes();
        let [n, k, r, p, m] = sizes;
        let zeros = |count: usize| vec![T::ZERO; count];
        let bounds = |bounds: &Bounds<f64>| Bounds {
            torque: bounds.torque.map(T::from_f64),
            change: bounds.change.map(T::from_f64),
        };
        let columns = |matrix: &Matrix<f64>, first: usize, count: usize| {
            entries(&Matrix::from_fn(matrix.rows(), count, |i, j| matrix[(i, first + j)]))
        };
        let governor = |governor: &GovernorData| {
            let all = &governor.prediction;
            [columns(all, 0, n), columns(all, n, k), columns(all, n + k, r), T::list(&governor.bounds)]
        };
        Self {
            sizes,
            prediction: entries(&data.prediction),
            input: entries(&data.input),
            output: entries(&data.output),
            correction: entries(&data.correction),
            model: entries(&data.model),
            model_input: entries(&data.model_input),
            feedback: entries(&data.feedback),
            bounds: data.bounds.iter().map(bounds).collect(),
            governor: data.governor.as_ref().map(governor),
            readings: readings.to_vec(),
            offsets: offsets.to_vec(),
            memory: zeros(n + k + p + r + m),
            read: zeros(p),
            told: zeros(r),
            work: zeros(Regulator::<T>::work(n, k, r, p)),
            health: Health::default(),
        }
    }
}

impl<T: Float> Block for Runner<T> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        keeper.floats(&mut self.memory);
        keep_health(&mut self.health, keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        let [n, k, r, p, m] = self.sizes;
        for (number, reading) in self.readings.iter().enumerate() {
            let value = match seen.readings.get(number) {
                Some(value) => *value,
                None => reading.read(seen.angles, seen.speeds),
            };
            self.read[number] = T::from_f64(value - self.offsets[number]);
        }
        T::narrow(seen.references, &mut self.told);
        T::narrow(seen.states, &mut self.memory);
        let gain = |matrix, columns: usize| Gain::new(matrix, columns.max(1));
        let fit = || {
            let governor = match &self.governor {
                Some([state, model, references, bounds]) => Some(Governor {
                    on_state: gain(state, n)?,
                    on_model: gain(model, k)?,
                    on_references: gain(references, r)?,
                    bounds,
                }),
                None => None,
            };
            Some(Regulator {
                prediction: gain(&self.prediction, n)?,
                input: gain(&self.input, m)?,
                output: gain(&self.output, n)?,
                correction: gain(&self.correction, p)?,
                model: gain(&self.model, k)?,
                model_input: gain(&self.model_input, r)?,
                feedback: gain(&self.feedback, n + k + r)?,
                bounds: &self.bounds,
                governor,
            })
        };
        let Some(block) = fit() else { unreachable!("matrices are made of whole rows by the design") };
        let (estimate, rest) = self.memory.split_at_mut(n);
        let (model, rest) = rest.split_at_mut(k);
        let (readings, rest) = rest.split_at_mut(p);
        let (references, commands) = rest.split_at_mut(r);
        let memory = RegulatorMemory { estimate, model, readings, references, commands, work: &mut self.work };
        self.health = block.step(&self.read, &self.told, memory);
        T::widen(&self.memory[n + k + p + r..], out);
    }

    fn next(&mut self, _: Seen<'_>, _: &[f64], out: &mut [f64]) {
        T::widen(&self.memory, out);
    }

    fn health(&self) -> Health {
        self.health
    }
}
