//! An observer with the nonlinear model of a mechanism as its prediction.

use crate::dense::{add_scaled, at, copy, dot, factor, row, solve_factored, sum};
use crate::mechanism::{modelled_forces, take};
use crate::{Mechanism, Real};

/// A part of a list of coefficients over the shafts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Row {
    /// Number of its first entry.
    pub first: usize,
    /// How many entries it has.
    pub count: usize,
}

/// The reading of a sensor of a mechanism: `Σ c q − rest` over the shafts, or `Σ c q̇ − rest`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensor<T> {
    /// Shafts and coefficients: one shaft with coefficient 1 for an encoder; stiffness times direction for the torque of a spring.
    pub row: Row,
    /// Whether it reads speeds.
    pub speed: bool,
    /// The constant that the reading subtracts.
    pub rest: T,
}

impl<T: Real> Sensor<T> {
    /// The reading at these angles (rad) and speeds (rad/s) of all shafts, from the list that its row is a part of.
    #[inline]
    pub(crate) fn reading(&self, entries: &[(usize, T)], angles: &[T], speeds: &[T]) -> T {
        let of = if self.speed { speeds } else { angles };
        let own = entries.get(self.row.first..).and_then(|rest| rest.get(..self.row.count));
        let terms: &[(usize, T)] = own.map_or(&[], |terms| terms);
        terms.iter().fold(T::ZERO, |sum, (shaft, c)| sum + *c * at(of, *shaft)) - self.rest
    }
}

/// An observer that runs the nonlinear model: a copy of the mechanism, driven by the commanded torques u and corrected
/// by the difference between the readings and their predictions.
///
/// ```text
/// q̂′ = ŵ + L_q e
/// ŵ′ = H(q̂)⁻¹ (passive(q̂, ŵ) + F(q̂) u + K(q̂)ᵀ d̂) + L_w e
/// d̂′ = L_d e                         e = y − (readings expected at q̂, ŵ)
/// ```
///
/// d̂ are unknown constant torques on shafts. The gain L belongs to the linear model at one position; where the copy is the plant
/// and the start is right, the estimate is the state at every position, whatever L is. On a linear model it is the observer of
/// [`StateSpace`](crate::StateSpace).
///
/// ```
/// use kardan_rt::{Mechanism, ModelObserver, Plan, Row, Sensor};
/// // A body of 2 kg m² with an encoder; the observer finds an unknown torque of 3 N m on it.
/// let body = Mechanism {
///     shafts: 1, coordinates: 1, cuts: 0, inputs: 1, frictions: &[],
///     plan: Plan {
///         inputs: 2, constants: &[0.0, 1.0, 2.0], runs: &[], operands: &[], outputs: &[0, 1, 2, 3, 4, 2, 2, 3],
///         tables: &[], numbers: &[],
///     },
/// };
/// let sensors = [Sensor { row: Row { first: 0, count: 1 }, speed: false, rest: 0.0 }];
/// // Poles of the error at −10, three times: (s + 10)³ = s³ + L_q s² + L_w s + L_d/2.
/// let gain = [30.0, 300.0, 2000.0];
/// let zoh_integral = [0.0; 9];
/// let observer = ModelObserver {
///     mechanism: body, inputs: &[0], sensors: &sensors, entries: &[(0, 1.0)], disturbances: &[0],
///     gain: &gain, zoh_integral: &zoh_integral, friction_width: None,
/// };
/// let mut memory = [0.0; 18];
/// assert_eq!(memory.len(), observer.memory());
/// // q = w = 1, d̂ = 3, u = −1; the encoder reads 1.5: e = 0.5.
/// let mut rates = [0.0; 3];
/// assert!(observer.rates(&[1.0, 1.0, 3.0], &[-1.0], &[1.5], &mut memory, &mut rates));
/// assert_eq!(rates, [1.0 + 15.0, 1.0 + 150.0, 1000.0]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelObserver<'a, T> {
    /// The model.
    pub mechanism: Mechanism<'a, T>,
    /// Numbers of the inputs whose torques it receives.
    pub inputs: &'a [usize],
    /// The sensors.
    pub sensors: &'a [Sensor<T>],
    /// Shaft and coefficient; the rows of the sensors are parts of this list.
    pub entries: &'a [(usize, T)],
    /// Shafts on which an unknown torque acts.
    pub disturbances: &'a [usize],
    /// L, row by row: states (angles, speeds, torques) × sensors.
    pub gain: &'a [T],
    /// Γ = ∫ exp((A − L C) t) dt over a sample time, of the linear model that L belongs to, states × states; for
    /// [`step`](Self::step) only.
    pub zoh_integral: &'a [T],
    /// Speed w₀ (rad/s) of the Coulomb friction `c·w/√(w²+w₀²)` that the model has; none: it has no Coulomb friction.
    pub friction_width: Option<T>,
}

impl<T: Real> ModelObserver<'_, T> {
    /// Number of states: angles and speeds of the r coordinates, then the torques.
    pub const fn states(&self) -> usize {
        let r = self.mechanism.coordinates;
        sum(&[r, r, self.disturbances.len()])
    }

    /// Entries of memory that an evaluation needs: those of the mechanism, r² + r, and one for each state.
    pub fn memory(&self) -> usize {
        let r = self.mechanism.coordinates;
        sum(&[self.mechanism.memory(), r.saturating_mul(r), r, self.states()])
    }

    /// The derivative of the state, per second, while the inputs apply `torques` (N m) and the sensors read `readings`.
    ///
    /// Returns false and leaves `out` unchanged if there is no finite result (a reading is NaN, say) or a list is too
    /// short.
    #[must_use = "false: there is no output"]
    pub fn rates(&self, state: &[T], torques: &[T], readings: &[T], memory: &mut [T], out: &mut [T]) -> bool {
        let Some(found) = self.found(state, torques, readings, memory) else { return false };
        let Some(out) = out.get_mut(..found.len()) else { return false };
        copy(found, out);
        true
    }

    /// One sample: `x̂ ← x̂ + Γ x̂′`, with torques and readings constant over it (zero-order hold). Exact for the
    /// linear model that Γ belongs to; for another model the difference is constant over the sample too.
    ///
    /// Returns false and leaves the state unchanged if the new one is not finite, or so large that its fourth power is
    /// not: the equations, which contain products of speeds and curves, would overflow from there on. So one bad sample
    /// does not stay in the block.
    #[must_use = "false: the sample was dropped"]
    pub fn step(&self, state: &mut [T], torques: &[T], readings: &[T], memory: &mut [T]) -> bool {
        let n = self.states();
        let Some(found) = self.found(state, torques, readings, memory) else { return false };
        let change = |i: usize| dot(row(self.zoh_integral, i, n), found);
        let Some(state) = state.get_mut(..n) else { return false };
        let usable = |x: T| (x * x * x * x).is_finite();
        if self.zoh_integral.len() < n.saturating_mul(n)
            || !state.iter().enumerate().all(|(i, x)| usable(*x + change(i)))
        {
            return false;
        }
        for (i, x) in state.iter_mut().enumerate() {
            *x = *x + change(i);
        }
        true
    }

    /// x̂′ in the memory, if it is finite.
    fn found<'m>(&self, state: &[T], torques: &[T], readings: &[T], mut memory: &'m mut [T]) -> Option<&'m [T]> {
        let (r, p) = (self.mechanism.coordinates, self.sensors.len());
        let (position, rest) = state.split_at_checked(r)?;
        let (speed, disturbing) = rest.split_at_checked(r)?;
        let disturbing = disturbing.get(..self.disturbances.len())?;
        let evaluated = self.mechanism.evaluate_in(position, speed, &mut memory)?;
        let force = take(&mut memory, r)?;
        let lower = take(&mut memory, r.checked_mul(r)?)?;
        let out = take(&mut memory, self.states())?;
        modelled_forces(&self.mechanism, &evaluated, self.friction_width, force);
        for (shaft, torque) in self.disturbances.iter().zip(disturbing) {
            add_scaled(*torque, row(evaluated.basis, *shaft, r), force);
        }
        for (number, torque) in self.inputs.iter().zip(torques) {
            if *number >= self.mechanism.inputs {
                return None;
            }
            add_scaled(*torque, row(evaluated.inputs, *number, r), force);
        }
        factor(evaluated.inertia, r, r, lower)?;
        solve_factored(lower, r, force)?;
        let (angles, after_angles) = out.split_at_mut_checked(r)?;
        let (speeds, wander) = after_angles.split_at_mut_checked(r)?;
        copy(speed, angles);
        copy(force, speeds);
        wander.fill(T::ZERO);
        for (k, sensor) in self.sensors.iter().enumerate() {
            let error = *readings.get(k)? - sensor.reading(self.entries, evaluated.angles, evaluated.speeds);
            for (gain, rate) in self.gain.chunks_exact(p).zip(out.iter_mut()) {
                *rate = *rate + at(gain, k) * error;
            }
        }
        out.iter().all(|x| x.is_finite()).then_some(&*out)
    }
}
