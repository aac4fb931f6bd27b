//! The block of a PID controller with anti-windup.

use super::{clamped, half, is_on, one, store, zero};
use crate::Arithmetic;

/// A controller of proportional, integral and filtered derivative parts: setpoint weights, bounds, and anti-windup by back-calculation
/// (Åström and Hägglund, Advanced PID Control, chapters 3 and 13).
///
/// ```text
/// v = K (b r − y) + I + D,  u = v within bounds
/// I⁺ = I + h (Ki (r − y) + (u − v)/Tt)
/// D = (Tf D⁻ + Kd (e − e⁻))/(Tf + h),  e = c r − y
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pid<N> {
    /// K.
    pub proportional: N,
    /// Ki, 1/s times the unit of K; without it I bridges a switching and decays: `I⁺ = I − h I/Tt`.
    pub integral: Option<N>,
    /// Kd, s times the unit of K.
    pub derivative: N,
    /// Tf, s: the time constant of the filter of the derivative, not negative.
    pub filter: N,
    /// b and c: shares of the reference in the proportional and in the derivative part.
    pub weights: [N; 2],
    /// The smallest and the largest output, if there are bounds.
    pub bounds: [Option<N>; 2],
    /// Tt, s, not zero: time constant with which the integral tracks a bounded output (anti-windup), or with which I
    /// decays after a switching.
    pub tracking: N,
    /// h, s.
    pub sample_time: N,
}

/// The command in place of a [`Pid`] while it is off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Manual<N> {
    /// Whether the controller is on: above a half.
    pub on: N,
    /// The output while it is off.
    pub value: N,
}

impl<N: Arithmetic> Pid<N> {
    /// Entries of its memory: the output, I, D, the previous e, and whether there was a sample (1, else 0).
    pub const STATES: usize = 5;

    /// One sample with a reference r and a measurement y. Returns false and leaves the memory unchanged where an input
    /// is not a number.
    ///
    /// The output continues without a jump when the controller is switched on (bumpless transfer): while it is off, I
    /// is set so that the controller would output the manual value.
    ///
    /// ```
    /// use kardan_rt::{Manual, Pid};
    /// let pid = Pid {
    ///     proportional: 2.0, integral: Some(10.0), derivative: 0.0, filter: 0.0, weights: [1.0, 0.0], bounds: [None, Some(5.0)], tracking: 0.1, sample_time: 0.01,
    /// };
    /// let mut state = [0.0_f64; 5];
    /// assert!(pid.step(1.0, 0.5, Manual { on: 0.0, value: 3.0 }, &mut state) && state[0] == 3.0);
    /// // Switched on it outputs the manual command, and continues from there.
    /// assert!(pid.step(1.0, 0.5, Manual { on: 1.0, value: 0.0 }, &mut state) && state[0] == 3.0);
    /// assert!(pid.step(1.0, 0.5, Manual { on: 1.0, value: 0.0 }, &mut state) && (state[0] - 3.05).abs() < 1e-15);
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, reference: N, measured: N, manual: Manual<N>, state: &mut [N; 5]) -> bool {
        let [_, integral, slope, before, begun] = *state;
        let [of_reference, of_rate] = self.weights;
        let [low, high] = self.bounds;
        let on = is_on(manual.on);
        let weighted = of_rate * reference - measured;
        // The first sample has none before it.
        let step = half::<N>().select(begun, weighted - before, zero());
        let (filter, time) = (self.filter, self.sample_time);
        let slope = (filter * slope + self.derivative * step) / (filter + time);
        let direct = self.proportional * (of_reference * reference - measured) + slope;
        let free = direct + integral;
        let bounded = clamped(free, low, high);
        let output = half::<N>().select(on, bounded, manual.value);
        let rate = match self.integral {
            Some(by_time) => by_time * (reference - measured) + (bounded - free) / self.tracking,
            None => -integral / self.tracking,
        };
        let next = integral + time * rate;
        let next = half::<N>().select(on, next, manual.value - direct);
        let new = [output, next, slope, weighted, one()];
        store(state, new, &[reference, measured, manual.on, manual.value])
    }
}
