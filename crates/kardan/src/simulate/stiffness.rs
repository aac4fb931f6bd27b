//! Whether a loop is stiff: a guess from its rates at the start, which decides about the method alone.

use super::{Machine, Scenario};
use crate::num::{Matrix, dot, eigenvalues};

/// Of loops with more states the fastest motions alone are looked at, in so many products with the derivatives: all poles cost the cube of the
/// states.
const MOST_STATES: usize = 100;
const PRODUCTS: usize = 40;
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
    if states == 0 {
        return false;
    }
    let slopes = if states > MOST_STATES { fastest(machine, state, states) } else { slopes(machine, state, states) };
    let Some(poles) = eigenvalues(&slopes) else { return false };
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

/// The derivatives in the space of their first powers times one vector, whose poles are near the outermost ones (Arnoldi 1951).
fn fastest(machine: &mut Machine, state: &[f64], states: usize) -> Matrix<f64> {
    let scale = CHANGE * state[..states].iter().fold(1.0f64, |most, x| most.max(x.abs()));
    let (mut there, mut plus, mut minus) = (state.to_vec(), state.to_vec(), state.to_vec());
    // Without the symmetry that a model may have.
    let mut next: Vec<f64> = (0..states).map(|k| 1.0 + (k * 7 % 11) as f64).collect();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut out = Matrix::zeros(PRODUCTS, PRODUCTS);
    for step in 0..PRODUCTS {
        let size = dot(&next, &next).sqrt();
        if step > 0 {
            out[(step, step - 1)] = size;
        }
        if !(size > 0.0 && size.is_finite()) {
            break;
        }
        basis.push(next.iter().map(|x| x / size).collect());
        let direction = &basis[step];
        let change = scale / direction.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let along = |sign: f64, there: &mut [f64]| {
            there.iter_mut().zip(state).zip(direction).for_each(|((there, x), d)| *there = x + sign * change * d);
        };
        along(1.0, &mut there);
        machine.derivative(0.0, &there, &mut plus);
        along(-1.0, &mut there);
        machine.derivative(0.0, &there, &mut minus);
        next.iter_mut().zip(plus.iter().zip(&minus)).for_each(|(next, (p, m))| *next = (p - m) / (2.0 * change));
        // Twice, so that the basis is orthogonal.
        for _ in 0..2 {
            for (k, known) in basis.iter().enumerate() {
                let part = dot(known, &next);
                out[(k, step)] += part;
                next.iter_mut().zip(known).for_each(|(next, known)| *next -= part * known);
            }
        }
    }
    out
}
