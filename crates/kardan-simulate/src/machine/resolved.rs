//! The data that judge steps: the operations of the loop that have a scale, and the values that are read from it.

use kardan_expr::expr::Interval;
use kardan_expr::plan::Resolution;

/// The data that judge a step.
pub(super) struct Resolved {
    pub resolution: Resolution,
    /// Forces, rates of the states behind the speeds with the powers, and further values that are read from the plan.
    pub forces: Vec<usize>,
    pub rates: Vec<usize>,
    pub outputs: Vec<usize>,
    /// The indices of arguments, and for each the range of its values in the evaluations of a step.
    pub arguments: Vec<usize>,
    pub noted: Vec<(f64, f64)>,
    /// Memory.
    pub inputs: Vec<Interval>,
    pub column: Vec<f64>,
    pub accelerations: Vec<f64>,
}
