//! A regulator with gains scheduled by a coordinate of its estimate.

use crate::dense::{all_finite, at, copy, sum};
use crate::mechanism::take;
use crate::regulator::NonlinearTerms;
use crate::{Bounds, Gain, Governor, Health, Mechanism, Real, Regulator, RegulatorState, Schedule, Sensor};

/// A [`Regulator`] for a plant whose linear model depends on its position: its gains are scheduled by a coordinate of
/// the estimate; the mechanism itself predicts the readings and the forces that grow with the square of the speeds.
///
/// ```text
/// (A, B, C, M, K, …) = numbers at the coordinate, linear between the points of the design
/// f = −Σ J (aᵀk) Kᵀa                   at q̂, ŵ: forces of nonlinear inertia directions, quadratic in speeds; 0 where a sample is too long
/// x̂ ← x̂ + M (y − h(x̂))                h: the predicted readings at q̂, ŵ
/// u  = −K [x̂; ξ; r] − K_f f, within bounds
/// x̂ ← A x̂ + B u + G f
/// ```
///
/// The first entries of x̂ are the angles of the mechanism's coordinates, then their speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScheduledRegulator<'a, T> {
    /// The numbers of each point: A, B, C, M, K, G, K_f, and of the governor Pₓ, Pξ, Pᵣ, each row by row; as many as
    /// [`width`](Self::width) returns.
    pub schedule: Schedule<'a, T>,
    /// Number of the coordinate that it follows.
    pub coordinate: usize,
    /// Aξ, states of the reference model squared.
    pub model: Gain<'a, T>,
    /// Bξ, states of the reference model × references.
    pub model_input: Gain<'a, T>,
    /// Bounds of the motors.
    pub bounds: &'a [Bounds<T>],
    /// Bound of each prediction of the governor, N m; empty for none.
    pub governor_bounds: &'a [T],
    /// The plant.
    pub mechanism: Mechanism<'a, T>,
    /// The sensors.
    pub sensors: &'a [Sensor<T>],
    /// Shaft and coefficient; the rows of the sensors are parts of this list.
    pub entries: &'a [(usize, T)],
}

impl<T: Real> ScheduledRegulator<'_, T> {
    /// Numbers of a point for these numbers of states, states of the reference model, references, readings and commands.
    pub const fn width(
        states: usize,
        model: usize,
        references: usize,
        readings: usize,
        commands: usize,
        coordinates: usize,
        predictions: usize,
    ) -> usize {
        let augmented = sum(&[states, model, references]);
        sum(&[
            states.saturating_mul(sum(&[states, commands, readings, readings, coordinates])),
            commands.saturating_mul(sum(&[augmented, coordinates])),
            predictions.saturating_mul(augmented),
        ])
    }

    /// Entries of the scratch memory of [`step`](Self::step).
    pub fn scratch(&self, states: usize, model: usize, references: usize, commands: usize) -> usize {
        let (p, c) = (self.sensors.len(), self.mechanism.coordinates);
        let width = Self::width(states, model, references, p, commands, c, self.governor_bounds.len());
        sum(&[width, p, c, self.mechanism.memory()])
    }

    /// One sample, as [`Regulator::step`]. `scratch` has no state. If it is too short or an estimate is not finite, all
    /// states stay unchanged; where the mechanism has no finite result, the block uses the linear prediction C x̂ and
    /// no force.
    pub fn step(&self, readings: &[T], references: &[T], memory: RegulatorState<'_, T>, scratch: &mut [T]) -> Health {
        match self.found(readings, references, memory, scratch) {
            Some(health) => health,
            None => Health { estimate_frozen: true, ..Health::default() },
        }
    }

    fn found(
        &self,
        readings: &[T],
        references: &[T],
        memory: RegulatorState<'_, T>,
        scratch: &mut [T],
    ) -> Option<Health> {
        let [n, k, r, m] = [&*memory.estimate, &*memory.model, &*memory.references, &*memory.commands].map(<[T]>::len);
        let (p, c, g) = (self.sensors.len(), self.mechanism.coordinates, self.governor_bounds.len());
        let mut rest = scratch;
        let numbers = take(&mut rest, Self::width(n, k, r, p, m, c, g))?;
        let (foreseen, forces) = (take(&mut rest, p)?, take(&mut rest, c)?);
        if !self.schedule.at(at(memory.estimate, self.coordinate), numbers) {
            return None;
        }
        let predicted = self.predict(memory.estimate, foreseen, forces, rest);
        let mut numbers: &[T] = numbers;
        let mut next = |rows: usize, columns: usize| {
            let (head, tail) = numbers.split_at_checked(rows.checked_mul(columns)?)?;
            numbers = tail;
            Gain::new(head, columns.max(1))
        };
        let (prediction, input, output) = (next(n, n)?, next(n, m)?, next(p, n)?);
        let (correction, feedback) = (next(n, p)?, next(m, sum(&[n, k, r]))?);
        let (force_input, on_forces) = (next(n, c)?, next(m, c)?);
        if predicted.is_none() || !self.is_predictable(memory.estimate, &force_input, forces) {
            forces.fill(T::ZERO);
        }
        let governor = if g > 0 {
            let (on_state, on_model, on_references) = (next(g, n)?, next(g, k)?, next(g, r)?);
            Some(Governor { on_state, on_model, on_references, bounds: self.governor_bounds })
        } else {
            None
        };
        let (model, model_input, bounds) = (self.model, self.model_input, self.bounds);
        let block = Regulator { prediction, input, output, correction, model, model_input, feedback, bounds, governor };
        let nonlinear = NonlinearTerms { foreseen: predicted.map(|()| &*foreseen), forces, on_forces, force_input };
        Some(block.advance(readings, references, memory, Some(nonlinear)))
    }

    /// The predicted readings at an estimate, and the forces of its speeds; `None` if a number is not finite.
    fn predict(&self, estimate: &[T], foreseen: &mut [T], forces: &mut [T], memory: &mut [T]) -> Option<()> {
        let c = self.mechanism.coordinates;
        let (position, rest) = estimate.split_at_checked(c)?;
        let evaluated = self.mechanism.evaluate(position, rest.get(..c)?, memory)?;
        for (foreseen, sensor) in foreseen.iter_mut().zip(self.sensors) {
            *foreseen = sensor.reading(self.entries, evaluated.angles, evaluated.speeds);
        }
        copy(evaluated.centrifugal, forces);
        (all_finite(foreseen) && all_finite(forces)).then_some(())
    }

    /// Whether the forces change no speed by more than a sixteenth of the largest one in a sample. Above that the
    /// sample time is too long to predict their effect, and an estimate that one bad reading made huge would grow by
    /// itself.
    fn is_predictable(&self, estimate: &[T], force_input: &Gain<'_, T>, forces: &[T]) -> bool {
        let c = self.mechanism.coordinates;
        let speeds = estimate.iter().skip(c).take(c);
        let largest = speeds.fold(T::ZERO, |max, x| if x.abs() > max { x.abs() } else { max });
        let share = T::ONE / T::count(16);
        (c..c.saturating_mul(2)).all(|i| force_input.row_times(i, forces).abs() <= share * largest)
    }
}
