//! The block of an integrator with bounds.

use super::{clamped, half, store};
use crate::Arithmetic;

/// The integral of a signal over time, between bounds if it has any: `y⁺ = y + h u` (forward), or `y = y⁻ + h (u + u⁻)/2` (trapezoidal).
///
/// The output of a forward integrator does not depend on the input of that sample, so it may close a loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integrator<N> {
    /// The sample time h, s.
    pub sample_time: N,
    /// The smallest output, if there is a bound.
    pub low: Option<N>,
    /// The largest output, not below the smallest, if there is a bound.
    pub high: Option<N>,
}

impl<N: Arithmetic> Integrator<N> {
    /// Entries of its memory: the output, and the sum.
    pub const STATES: usize = 2;

    /// One sample; where `reset` is above a half, the output is `reset_to`, and integration continues from there.
    /// Returns false and leaves the memory unchanged where an input is not a number.
    ///
    /// ```
    /// let sum = kardan_rt::Integrator { sample_time: 0.5, low: None, high: Some(1.2) };
    /// let mut state = [0.0; 2];
    /// for (input, reset, expected) in [(1.0, 0.0, 0.0), (1.0, 0.0, 0.5), (1.0, 0.0, 1.0), (1.0, 0.0, 1.2), (1.0, 1.0, 0.25), (0.0, 0.0, 0.75)] {
    ///     assert!(sum.step(input, reset, 0.25, &mut state) && state[0] == expected);
    /// }
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, reset: N, reset_to: N, state: &mut [N; 2]) -> bool {
        let [_, sum] = *state;
        let output = clamped(half::<N>().select(reset, reset_to, sum), self.low, self.high);
        let next = clamped(output + self.sample_time * input, self.low, self.high);
        store(state, [output, next], &[input, reset, reset_to])
    }

    /// One sample by the trapezoidal rule, whose output depends on its input at once; its memory contains the previous
    /// input as a part of the sum.
    ///
    /// ```
    /// let sum = kardan_rt::Integrator { sample_time: 0.5, low: None, high: None };
    /// let mut state = [0.0; 2];
    /// // The integral of t over the time, sampled at 0.5 s: t²/2 exactly.
    /// for (input, expected) in [(0.0, 0.0), (0.5, 0.125), (1.0, 0.5), (1.5, 1.125)] {
    ///     assert!(sum.step_trapezoidal(input, 0.0, 0.0, &mut state) && state[0] == expected);
    /// }
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step_trapezoidal(&self, input: N, reset: N, reset_to: N, state: &mut [N; 2]) -> bool {
        let [_, sum] = *state;
        let share = half::<N>() * self.sample_time * input;
        let output = clamped(half::<N>().select(reset, reset_to, sum + share), self.low, self.high);
        store(state, [output, output + share], &[input, reset, reset_to])
    }
}
