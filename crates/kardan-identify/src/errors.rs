//! How measurement errors enter the rows of samples.

/// How measurement errors enter the rows of samples.
///
/// Errors are those of the torques of all inputs, then of accelerations, speeds and positions of the reduced coordinates.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Errors {
    /// Columns that a part of the motion multiplies, and which: 0 accelerations, 1 speeds, 2 positions.
    pub columns: Vec<(usize, usize)>,
    /// Sample by sample: what each error adds to `y − Xθ` through known terms (rows × errors), then for each of these columns what the errors of
    /// its part add by its value (rows × degrees of freedom).
    pub slopes: Vec<f64>,
    /// Sample by sample: variances of the errors, then the covariances of accelerations and positions.
    pub variances: Vec<f64>,
}

impl Errors {
    /// Slopes of a sample.
    pub fn slopes_of(&self, rows: usize, inputs: usize, degrees_of_freedom: usize) -> usize {
        rows * (inputs + (3 + self.columns.len()) * degrees_of_freedom)
    }

    /// Variances of a sample.
    pub fn variances_of(inputs: usize, degrees_of_freedom: usize) -> usize {
        inputs + 4 * degrees_of_freedom
    }
}
