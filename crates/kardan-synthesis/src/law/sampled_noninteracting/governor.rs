//! The reference governor: predicted commands for constant references, and their bounds.

use kardan_rt::functions::powf;

use crate::matrix_parts::{side_by_side, stacked};
use crate::sampled::{GovernorData, Problem, RegulatorData};
use kardan_math::num::Matrix;

/// Share of a torque limit that the governor uses; the rest is a reserve for unpredicted torques.
const GOVERNED: f64 = 0.9;
/// Instants at which the governor predicts, and how far ahead, in time constants of the slowest reference model.
const INSTANTS: usize = 24;
/// See [`INSTANTS`].
const HORIZON: f64 = 4.0;

/// Predicted commands for constant references, at instants that lie the closer the sooner; `None` without limits.
///
/// An external torque (the driver's hands) balances a shaft under a torque channel: where the law has no estimate of it, its torque
/// on the shaft is taken as balanced. A freely accelerating shaft would seem to need ever more torque.
pub(super) fn governor(
    data: &RegulatorData,
    problem: &Problem,
    responses: &[(usize, Vec<f64>)],
) -> Option<GovernorData> {
    let [n, k, r, _, m] = data.sizes();
    let limited: Vec<(usize, f64)> =
        data.bounds.iter().enumerate().filter_map(|(i, bounds)| Some((i, bounds.torque?))).collect();
    if limited.is_empty() {
        return None;
    }
    let size = n + k + r;
    let slowest = problem.targets.iter().map(|target| target.bandwidth).fold(f64::INFINITY, f64::min);
    let horizon = (HORIZON / (slowest * problem.clock.period)).ceil().max(1.0);
    let mut instants: Vec<usize> =
        (0..INSTANTS).map(|i| (powf(horizon, i as f64 / (INSTANTS - 1) as f64)).round() as usize - 1).collect();
    instants.dedup();
    // [x̂; ξ; r]⁺ with u = −K [x̂; ξ; r].
    let estimate = Matrix::from_fn(n, size, |i, j| {
        let fed: f64 = (0..m).map(|l| data.input[(i, l)] * data.feedback[(l, j)]).sum();
        if j < n { data.prediction[(i, j)] - fed } else { -fed }
    });
    let model = side_by_side(&[&Matrix::zeros(k, n), &data.model, &data.model_input]);
    let references = side_by_side(&[&Matrix::zeros(r, n + k), &Matrix::identity(r)]);
    let mut closed = stacked(&[&estimate, &model, &references]);
    for (channel, torque) in responses {
        torque.iter().enumerate().for_each(|(i, x)| closed[(i, n + 2 * channel)] -= x);
    }
    // Squares of it, as far as they are needed: a slow reference model takes millions of samples.
    let mut squares = vec![closed];
    let mut rows: Vec<Vec<f64>> = Vec::new();
    let mut bounds = Vec::new();
    let mut now = data.feedback.scale(&-1.0);
    let mut instant = 0;
    for &at in &instants {
        let samples = at - instant;
        for bit in (0..usize::BITS as usize).take_while(|bit| samples >> bit > 0) {
            if bit == squares.len() {
                squares.push(squares[bit - 1].multiply(&squares[bit - 1]));
            }
            if samples >> bit & 1 == 1 {
                now = now.multiply(&squares[bit]);
            }
        }
        instant = at;
        for &(motor, limit) in &limited {
            rows.push(now.row(motor).to_vec());
            bounds.push(GOVERNED * limit);
        }
    }
    Some(GovernorData { prediction: Matrix::from_fn(rows.len(), size, |i, j| rows[i][j]), bounds })
}
