//! Whether a loop is stiff: an estimate from its rates at the start, which only selects the method.

use super::{Machine, Scenario};
use kardan_math::num::{Matrix, dot, eigenvalues};

/// For loops with more states only the fastest motions are computed, in this many products with the derivatives: all
/// poles cost the cube of the states.
const MOST_STATES: usize = 100;
const PRODUCTS: usize = 40;
/// A motion counts as decayed after this many time constants.
const GONE: f64 = 16.0;
/// Step length of the explicit method in time constants of the fastest motion, decayed or not, and of the implicit one
/// in those of the fastest that has not decayed.
const EXPLICIT_STEP: f64 = 6.0;
const IMPLICIT_STEP: f64 = 2.0;
/// Steps of the implicit method after a start.
const BEGIN: f64 = 15.0;
/// Approximate time of a step of the implicit method in steps of the explicit one; and for many states.
const DEARER: [f64; 2] = [10.0, 4.0];
/// Relative perturbation of a state.
const CHANGE: f64 = 1e-6;

/// Whether the implicit method is expected to be faster: fast decaying motions limit the steps of the explicit one by
/// this factor.
pub(super) fn is_stiff(machine: &mut Machine, scenario: &Scenario, state: &[f64]) -> bool {
    let states = machine.size() - 2;
    if states == 0 {
        return false;
    }
    let many = states > MOST_STATES;
    let slopes = if many { fastest(machine, state, states) } else { slopes(machine, state, states) };
    let Some(poles) = eigenvalues(&slopes) else { return false };
    // Each breakpoint and each sample is a start.
    let begins = scenario.events.iter().map(|event| if event.over > 0.0 { 2.0 } else { 1.0 }).sum::<f64>() + 1.0;
    let begins = begins + machine.timed.breakpoints(scenario.duration) as f64;
    let mut length = machine.shortest_period().min(scenario.duration / begins);
    if !length.is_finite() {
        length = 1.0;
    }
    let (mut explicit, mut implicit) = (0.0f64, 0.0f64);
    for (real, imaginary) in poles {
        let rate = (real * real + imaginary * imaginary).sqrt();
        explicit = explicit.max(rate * length / EXPLICIT_STEP);
        let duration = if real < 0.0 { length.min(-GONE / real) } else { length };
        implicit = implicit.max(rate * duration / IMPLICIT_STEP);
    }
    let implicit = BEGIN + implicit;
    explicit > DEARER[usize::from(many)] * implicit
}

/// The derivatives of the rates by differences.
fn slopes(machine: &mut Machine, state: &[f64], states: usize) -> Matrix<f64> {
    let mut out = Matrix::zeros(states, states);
    let (mut perturbed, mut plus, mut minus) = (state.to_vec(), state.to_vec(), state.to_vec());
    for k in 0..states {
        let change = CHANGE * state[k].abs().max(1.0);
        perturbed[k] = state[k] + change;
        machine.derivative(0.0, &perturbed, &mut plus);
        perturbed[k] = state[k] - change;
        machine.derivative(0.0, &perturbed, &mut minus);
        perturbed[k] = state[k];
        (0..states).for_each(|i| out[(i, k)] = (plus[i] - minus[i]) / (2.0 * change));
    }
    out
}

/// The derivatives in the Krylov space of a vector, whose poles are near the outermost ones (Arnoldi 1951). Angles are
/// measured in a unit in which springs move them as fast as speeds: else poles of a damped chain seem to oscillate.
fn fastest(machine: &mut Machine, state: &[f64], states: usize) -> Matrix<f64> {
    let r = machine.degrees_of_freedom();
    // Without a symmetry that a model may have.
    let mut next: Vec<f64> = (0..states).map(|k| 1.0 + (k * 7 % 11) as f64).collect();
    let mut product = Product::new(machine, state, states);
    let angles: Vec<f64> = next.iter().enumerate().map(|(k, x)| if k < r { *x } else { 0.0 }).collect();
    let mut accelerations = vec![0.0; states];
    product.of(&angles, &mut accelerations);
    let ratio = dot(&accelerations[r..], &accelerations[r..]) / dot(&angles, &angles);
    if ratio > 0.0 && ratio.is_finite() {
        product.units[..r].fill(1.0 / ratio.sqrt().sqrt());
    }
    let (mut basis, mut out) = (Vec::<Vec<f64>>::new(), Matrix::zeros(PRODUCTS, PRODUCTS));
    for step in 0..PRODUCTS {
        let size = dot(&next, &next).sqrt();
        if step > 0 {
            out[(step, step - 1)] = size;
        }
        if !(size > 0.0 && size.is_finite()) {
            break;
        }
        basis.push(next.iter().map(|x| x / size).collect());
        product.of(&basis[step], &mut next);
        // Two passes, so that the basis is orthogonal.
        for _ in 0..2 {
            for (k, basis_vector) in basis.iter().enumerate() {
                let part = dot(basis_vector, &next);
                out[(k, step)] += part;
                next.iter_mut().zip(basis_vector).for_each(|(next, basis_vector)| *next -= part * basis_vector);
            }
        }
    }
    out
}

/// Products with the derivatives of the rates, by differences, in scaled units.
struct Product<'a> {
    machine: &'a mut Machine,
    state: &'a [f64],
    scale: f64,
    units: Vec<f64>,
    perturbed: Vec<f64>,
    rates: [Vec<f64>; 2],
}

impl<'a> Product<'a> {
    fn new(machine: &'a mut Machine, state: &'a [f64], states: usize) -> Self {
        let scale = CHANGE * state[..states].iter().fold(1.0f64, |most, x| most.max(x.abs()));
        let perturbed = state.to_vec();
        Self {
            machine,
            state,
            scale,
            units: vec![1.0; states],
            rates: [perturbed.clone(), perturbed.clone()],
            perturbed,
        }
    }

    fn of(&mut self, direction: &[f64], out: &mut [f64]) {
        let Self { machine, state, scale, units, perturbed, rates } = self;
        let moved = || direction.iter().zip(&*units).map(|(d, unit)| d * unit);
        let change = *scale / moved().fold(0.0f64, |most, x| most.max(x.abs()));
        for (sign, rates) in [1.0, -1.0].into_iter().zip(rates.iter_mut()) {
            for ((perturbed, x), d) in perturbed.iter_mut().zip(*state).zip(moved()) {
                *perturbed = x + sign * change * d;
            }
            machine.derivative(0.0, perturbed, rates);
        }
        for (((out, plus), minus), unit) in out.iter_mut().zip(&rates[0]).zip(&rates[1]).zip(&*units) {
            *out = (plus - minus) / (2.0 * change * unit);
        }
    }
}
