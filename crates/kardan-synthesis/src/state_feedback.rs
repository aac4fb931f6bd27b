//! Completes a state-feedback gain with prefilter and disturbance compensation.

use std::sync::Arc;

use super::linear_law::{Linear, LinearBlock};
use super::outputs::{Task, exact};
use super::regulator::{SteadyStateError, steady_state};
use super::{ExactLoop, Law, Request, SynthesisError, rounded};
use kardan_math::num::Matrix;
use kardan_results::{Design, ExactMatrix};

/// Completes a gain K found in floating point to the law `u = −K x + L r − M d`: references are reached at rest, constant
/// disturbances leave no trace in the outputs at rest.
///
/// # Errors
/// If there are references and no values of the outputs can be kept constant.
pub(super) fn state_feedback(
    request: &Request<'_>,
    task: &Task,
    law: &str,
    k: &Matrix<f64>,
    more: Vec<ExactMatrix>,
    mut notes: Vec<String>,
) -> Result<Arc<dyn Law>, SynthesisError> {
    let (inputs, states) = (&task.inputs, task.system.states.clone());
    let l = if task.outputs.is_empty() {
        Matrix::zeros(inputs.len(), 0)
    } else {
        let unheld = |error: SteadyStateError| {
            let help = "choose as many outputs as motors, and outputs that the motors can hold constant";
            SynthesisError::of(error.to_string(), &task.names, "cannot be held constant", help)
        };
        steady_state(&task.system).map_err(unheld)?.reference_gain(k)
    };
    let m = task.cancelling(k).unwrap_or_else(|| {
        if !task.disturbed.is_empty() {
            notes.push(
                "the estimated disturbances are not fed forward: they cause steady-state errors of the outputs".into(),
            );
        }
        Matrix::zeros(inputs.len(), task.disturbed.len())
    });
    let mut gains = vec![rounded(("K", "state gain K of u = -K x + L r", ""), inputs, &states, k)];
    if !task.outputs.is_empty() {
        gains.push(rounded(("L", "reference gain L", ""), inputs, &task.reference_names(), &l));
    }
    if !task.disturbed.is_empty() {
        gains.push(rounded(("M", "disturbance gain M of u = -K x + L r - M d", ""), inputs, &task.disturbed, &m));
    }
    gains.extend(more);
    let design = Design {
        controller: request.name.into(),
        law: law.into(),
        states,
        inputs: inputs.clone(),
        outputs: task.names.clone(),
        gains,
        notes,
        ..Design::default()
    };
    let found = exact(k).zip(exact(&l)).filter(|_| !task.outputs.is_empty());
    let exact = found.map(|(k, l)| {
        let plant = request.plant.system(inputs, &task.outputs);
        let found = ExactLoop::feedback(plant, task.system.clone(), [&k, &l], &task.references);
        ExactLoop { inverts: false, ..found }
    });
    let block = LinearBlock::gains(&task.over_motions(k), &l, &m);
    Ok(Arc::new(Linear::new(request, design, exact, task.references.clone(), block)))
}
