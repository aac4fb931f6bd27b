//! A sampled regulator: observer, state feedback, reference model and bounds.

use crate::dense::{all_finite, copy, sum};
use crate::{Bounds, Gain, Governor, Real};

/// A sampled controller that knows its plant: reference model, observer with the commands on their way as states, state
/// feedback, bounds of the motors.
///
/// At each sample, with the readings y and the references r:
///
/// ```text
/// x̂ ← x̂ + M (y − C x̂)                 correction by the readings
/// r ← governed r                       if there is a governor
/// u  = −K [x̂; ξ; r], within bounds
/// ξ ← Aξ ξ + Bξ r                      reference model
/// x̂ ← A x̂ + B u                        prediction, with the applied torques: no windup
/// ```
///
/// A reading or reference that is not finite is replaced by the last one that was. Commands are always finite and
/// within the bounds, for any reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Regulator<'a, T> {
    /// A, states × states.
    pub prediction: Gain<'a, T>,
    /// B, states × commands.
    pub input: Gain<'a, T>,
    /// C, readings × states.
    pub output: Gain<'a, T>,
    /// M, states × readings.
    pub correction: Gain<'a, T>,
    /// Aξ, states of the reference model squared.
    pub model: Gain<'a, T>,
    /// Bξ, states of the reference model × references.
    pub model_input: Gain<'a, T>,
    /// K, commands × (states, states of the reference model, references).
    pub feedback: Gain<'a, T>,
    /// Bounds of the motors.
    pub bounds: &'a [Bounds<T>],
    /// Limits references that would request more than the motors can give.
    pub governor: Option<Governor<'a, T>>,
}

/// The state of a [`Regulator`]. All zero at the start, except for the estimate of the plant state.
#[derive(Debug)]
pub struct RegulatorState<'m, T> {
    /// x̂
    pub estimate: &'m mut [T],
    /// ξ
    pub model: &'m mut [T],
    /// Last good readings.
    pub readings: &'m mut [T],
    /// Last good references, after the governor.
    pub references: &'m mut [T],
    /// The commands in force.
    pub commands: &'m mut [T],
    /// As many entries as [`Regulator::work`] returns.
    pub work: &'m mut [T],
}

/// Faults at a sample that the block handled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Health {
    /// Number of readings that were not finite and were replaced by the last valid ones.
    pub invalid_readings: usize,
    /// Number of references that were not finite and were replaced by the last valid ones.
    pub invalid_references: usize,
    /// Number of commands that differ from the requested ones: the bounds changed them, or the request was not finite.
    pub commands_bounded: usize,
    /// Whether the governor limited a reference.
    pub governed: bool,
    /// Whether the estimate or the reference model stayed unchanged: it overflowed, or the work memory was too short,
    /// and then the commands stayed unchanged as well.
    pub estimate_frozen: bool,
}

/// Inputs of a [`Regulator`] at a sample from a block with a better plant model than the linear one.
#[derive(Debug, Clone, Copy)]
pub struct NonlinearTerms<'a, T> {
    /// The predicted readings at x̂; `None`: C x̂.
    pub foreseen: Option<&'a [T]>,
    /// Forces f on the plant that the linear model leaves out, N m.
    pub forces: &'a [T],
    /// K_f, commands × forces.
    pub on_forces: Gain<'a, T>,
    /// G of `x̂ ← … + G f`, states × forces.
    pub force_input: Gain<'a, T>,
}

impl<T: Real> Regulator<'_, T> {
    /// Entries of [`RegulatorState::work`] for these numbers of states, states of the reference model, references and
    /// readings.
    pub const fn work(states: usize, model: usize, references: usize, readings: usize) -> usize {
        sum(&[states, states, model, model, references, references, readings])
    }

    /// One sample. `state.commands` receives the commands, N m.
    pub fn step(&self, readings: &[T], references: &[T], state: RegulatorState<'_, T>) -> Health {
        self.advance(readings, references, state, None)
    }

    /// [`step`](Self::step) with these further inputs.
    pub(crate) fn advance(
        &self,
        readings: &[T],
        references: &[T],
        state: RegulatorState<'_, T>,
        nonlinear: Option<NonlinearTerms<'_, T>>,
    ) -> Health {
        let RegulatorState { estimate, model, readings: read, references: governed, commands, work } = state;
        let failed = Health { estimate_frozen: true, ..Health::default() };
        let (n, k, r, p) = (estimate.len(), model.len(), governed.len(), read.len());
        let Some((augmented, work)) = work.split_at_mut_checked(sum(&[n, k, r])) else { return failed };
        let Some((next, work)) = work.split_at_mut_checked(n) else { return failed };
        let Some((next_model, work)) = work.split_at_mut_checked(k) else { return failed };
        let Some((desired, work)) = work.split_at_mut_checked(r) else { return failed };
        let Some((error, _)) = work.split_at_mut_checked(p) else { return failed };
        let mut health = Health { invalid_readings: hold(readings, read), ..Health::default() };
        copy(governed, desired);
        health.invalid_references = hold(references, desired);

        // The correction by the readings.
        error.fill(T::ZERO);
        match nonlinear.and_then(|nonlinear| nonlinear.foreseen) {
            Some(foreseen) => copy(foreseen, error),
            None => self.output.accumulate(estimate, error),
        }
        for (error, reading) in error.iter_mut().zip(read.iter()) {
            *error = *reading - *error;
        }
        let Some((corrected, rest)) = augmented.split_at_mut_checked(n) else { return health };
        copy(estimate, corrected);
        self.correction.accumulate(error, corrected);
        if !all_finite(corrected) {
            copy(estimate, corrected);
            health.estimate_frozen = true;
        }
        let Some((own_model, own_references)) = rest.split_at_mut_checked(k) else { return health };
        copy(model, own_model);
        if let Some(governor) = &self.governor {
            health.governed = governor.govern(corrected, own_model, desired, governed);
        } else {
            copy(desired, governed);
        }
        copy(governed, own_references);

        next_model.fill(T::ZERO);
        self.model_input.accumulate(governed, next_model);
        self.model.accumulate(own_model, next_model);

        // u = −K [x̂; ξ; r]; the sum for each command replaces the previous one.
        let before: &mut [T] = commands;
        for (number, command) in before.iter_mut().enumerate() {
            let fed = self.feedback.row_times(number, augmented);
            let desired = match &nonlinear {
                Some(nonlinear) => -(fed + nonlinear.on_forces.row_times(number, nonlinear.forces)),
                None => -fed,
            };
            let bounds = self.bounds.get(number).map_or(Bounds { torque: None, change: None }, |bounds| *bounds);
            *command = bounds.nearest(desired, *command);
            health.commands_bounded = health.commands_bounded.saturating_add(usize::from(*command != desired));
        }

        next.fill(T::ZERO);
        self.input.accumulate(before, next);
        self.prediction.accumulate(augmented.get(..n).map_or(&[], |x| x), next);
        if let Some(nonlinear) = &nonlinear {
            nonlinear.force_input.accumulate(nonlinear.forces, next);
        }
        for (found, failed) in [(next, estimate), (next_model, model)] {
            if all_finite(found) {
                copy(found, failed);
            } else {
                health.estimate_frozen = true;
            }
        }
        health
    }
}

/// Copies readings (or references) that are finite. Where they are not, or are missing, the last valid ones stay;
/// returns how many.
///
/// ```
/// let mut last_good = [1.0, 2.0];
/// assert_eq!(kardan_rt::hold(&[1.5, f64::NAN], &mut last_good), 1);
/// assert_eq!(last_good, [1.5, 2.0]);
/// ```
pub fn hold<T: Real>(from: &[T], to: &mut [T]) -> usize {
    let mut invalid = 0usize;
    for (k, to) in to.iter_mut().enumerate() {
        match from.get(k) {
            Some(value) if value.is_finite() => *to = *value,
            _ => invalid = invalid.saturating_add(1),
        }
    }
    invalid
}
