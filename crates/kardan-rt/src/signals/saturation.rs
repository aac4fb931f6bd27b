//! The block of a saturation.

use super::{clamped, store};
use crate::Arithmetic;

/// A signal between two bounds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saturation<N> {
    /// The smallest output, if there is a bound.
    pub low: Option<N>,
    /// The largest output, not below the smallest, if there is a bound.
    pub high: Option<N>,
}

impl<N: Arithmetic> Saturation<N> {
    /// Entries of its memory: the output.
    pub const STATES: usize = 1;

    /// The nearest number between the bounds. Returns false and leaves the output unchanged where the input is not a
    /// number.
    ///
    /// ```
    /// let limit = kardan_rt::Saturation { low: None, high: Some(3.0) };
    /// let mut output = [0.0];
    /// assert!(limit.step(5.0, &mut output) && output == [3.0]);
    /// assert!(!limit.step(f64::NAN, &mut output) && output == [3.0]);
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, state: &mut [N; 1]) -> bool {
        store(state, [clamped(input, self.low, self.high)], &[input])
    }
}
