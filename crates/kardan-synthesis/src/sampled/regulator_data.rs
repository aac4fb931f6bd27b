//! The numbers of a sampled regulator.

use kardan_rt::Bounds;

use crate::matrix_parts::column_range;
use kardan_math::num::Matrix;

/// The numbers of the block [`kardan_rt::Regulator`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RegulatorData {
    pub prediction: Matrix<f64>,
    pub input: Matrix<f64>,
    pub output: Matrix<f64>,
    pub correction: Matrix<f64>,
    pub model: Matrix<f64>,
    pub model_input: Matrix<f64>,
    pub feedback: Matrix<f64>,
    pub bounds: Vec<Bounds<f64>>,
    pub governor: Option<GovernorData>,
    /// K_f and G of forces that the linear model leaves out; empty columns where the law does not get them.
    pub on_forces: Matrix<f64>,
    pub force_input: Matrix<f64>,
}

/// The numbers of the block [`kardan_rt::Governor`].
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct GovernorData {
    /// Predictions × (states, states of the reference model, references).
    pub prediction: Matrix<f64>,
    /// N m
    pub bounds: Vec<f64>,
}

impl GovernorData {
    /// Its predictions on states, states of the reference model and references, of which there are so many.
    pub fn parts(&self, [n, k, r]: [usize; 3]) -> [Matrix<f64>; 3] {
        let all = &self.prediction;
        [0..n, n..n + k, n + k..n + k + r].map(|columns| column_range(all, columns))
    }
}

impl RegulatorData {
    /// States, states of the reference model, references, readings, commands.
    pub fn sizes(&self) -> [usize; 5] {
        let references = self.model_input.columns();
        [self.prediction.rows(), self.model.rows(), references, self.output.rows(), self.input.columns()]
    }

    /// The data of a point of a schedule, in the order of [`kardan_rt::ScheduledRegulator::schedule`].
    pub fn parts(&self) -> Vec<Matrix<f64>> {
        let [n, k, r, ..] = self.sizes();
        let own = [
            &self.prediction,
            &self.input,
            &self.output,
            &self.correction,
            &self.feedback,
            &self.force_input,
            &self.on_forces,
        ];
        own.into_iter().cloned().chain(self.governor.iter().flat_map(|governor| governor.parts([n, k, r]))).collect()
    }

    /// All of them, one after the other.
    pub fn numbers(&self) -> Vec<f64> {
        self.parts().iter().flat_map(|part| part.as_slice().to_vec()).collect()
    }
}
