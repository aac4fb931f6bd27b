//! Whether a loop is stiff: a guess from its rates at the start, which decides about the method alone.

use super::{Machine, Scenario};
use crate::num::{Matrix, eigenvalues};

/// Loops with more states are left to the explicit method: eigenvalues cost their cube.
const MOST_STATES: usize = 100;
/// Part of its rate that a motion decays with at least that is gone at once.
const DAMPED: f64 = 0.5;
/// Length of a step of the explicit method in time constants of the fastest motion, and of the implicit one in those of the fastest that is
/// left.
const EXPLICIT_STEP: f64 = 6.0;
const IMPLICIT_STEP: f64 = 2.0;
/// Steps of the implicit method until it is past what is gone at once.
const BEGIN: f64 = 15.0;
/// Time of a step of the implicit method in steps of the explicit one, about.
const DEARER: f64 = 10.0;
/// Part of the size of a state that it is changed by.
const CHANGE: f64 = 1e-6;

/// Whether the implicit method is expected to be faster: what decays at once limits the steps of the other one so much.
pub(super) fn is_stiff(machine: &mut Machine, scenario: &Scenario, state: &[f64]) -> bool {
    let states = machine.size() - 2;
    if states == 0 || states > MOST_STATES {
        return false;
    }
    let Some(poles) = eigenvalues(&slopes(machine, state, states)) else { return false };
    let largest = |damped: bool| {
        let alike = poles.iter().filter(|(real, imaginary)| {
            let size = (real * real + imaginary * imaginary).sqrt();
            (-real >= DAMPED * size) == damped
        });
        alike.map(|(real, imaginary)| (real * real + imaginary * imaginary).sqrt()).fold(0.0, f64::max)
    };
    // Each breakpoint and each sample is a start.
    let begins = scenario.events.iter().map(|event| if event.over > 0.0 { 2.0 } else { 1.0 }).sum::<f64>() + 1.0;
    let mut length = machine.shortest_period().min(scenario.duration / begins);
    if !length.is_finite() {
        length = 1.0;
    }
    let explicit = largest(true) * length / EXPLICIT_STEP;
    let implicit = BEGIN + largest(false) * length / IMPLICIT_STEP;
    explicit > DEARER * implicit
}

/// The derivatives of the rates by differences.
fn slopes(machine: &mut Machine, state: &[f64], states: usize) -> Matrix<f64> {
    let mut out = Matrix::zeros(states, states);
    let (mut there, mut plus, mut minus) = (state.to_vec(), state.to_vec(), state.to_vec());
    for k in 0..states {
        let change = CHANGE * state[k].abs().max(1.0);
        there[k] = state[k] + change;
        machine.derivative(0.0, &there, &mut plus);
        there[k] = state[k] - change;
        machine.derivative(0.0, &there, &mut minus);
        there[k] = state[k];
        (0..states).for_each(|i| out[(i, k)] = (plus[i] - minus[i]) / (2.0 * change));
    }
    out
}
