//! The block of a rate limiter.

use super::{clamped, half, one, store};
use crate::Arithmetic;

/// A signal that changes no faster than it may; it begins where its input is at the first sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateLimit<N> {
    /// Largest rise from one sample to the next.
    pub rise: N,
    /// Largest fall from one sample to the next, not negative.
    pub fall: N,
}

impl<N: Arithmetic> RateLimit<N> {
    /// Entries of its memory: the output, and whether there was a sample (1, else 0).
    pub const STATES: usize = 2;

    /// One sample. Returns false and leaves the output unchanged where the input is not a number.
    ///
    /// ```
    /// let slow = kardan_rt::RateLimit { rise: 0.5, fall: 2.0 };
    /// let mut state = [0.0; 2];
    /// for (input, expected) in [(1.0, 1.0), (3.0, 1.5), (3.0, 2.0), (-1.0, 0.0), (-1.0, -1.0)] {
    ///     assert!(slow.step(input, &mut state) && state[0] == expected);
    /// }
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, state: &mut [N; 2]) -> bool {
        let [before, begun] = *state;
        let limited = clamped(input, Some(before - self.fall), Some(before + self.rise));
        let output = half::<N>().select(begun, limited, input);
        store(state, [output, one()], &[input])
    }
}
