//! What steps are judged by: the operations of the loop that have a scale, and what is read of it.

use crate::expr::Interval;
use crate::plan::Resolution;

/// What a step is judged by.
pub(super) struct Resolved {
    pub resolution: Resolution,
    /// Forces, rates of the states behind the speeds with the powers, and what else is read of the plan.
    pub forces: Vec<usize>,
    pub rates: Vec<usize>,
    pub outputs: Vec<usize>,
    /// The places of arguments, and of each place the range of its values in the evaluations of a step.
    pub arguments: Vec<usize>,
    pub noted: Vec<(f64, f64)>,
    /// Memory.
    pub inputs: Vec<Interval>,
    pub column: Vec<f64>,
    pub accelerations: Vec<f64>,
}
