//! The block of a switch with two thresholds.

use super::{half, one, store};
use crate::Arithmetic;

/// A switch with two thresholds (Schmitt trigger): on from the upper one on, off from the lower one on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hysteresis<N> {
    /// It switches on where its input is not below.
    pub upper: N,
    /// It switches off where its input is not above; below the upper one.
    pub lower: N,
    /// Its output while it is off, and while it is on.
    pub levels: [N; 2],
}

impl<N: Arithmetic> Hysteresis<N> {
    /// Entries of its memory: the output, and whether it is on (1, else 0).
    pub const STATES: usize = 2;

    /// One sample. Returns false and leaves output and switch unchanged where the input is not a number.
    ///
    /// ```
    /// let switch = kardan_rt::Hysteresis { upper: 3.0, lower: 1.0, levels: [0.0, 10.0] };
    /// let mut state = [0.0; 2];
    /// for (input, expected) in [(2.0, 0.0), (3.0, 10.0), (2.0, 10.0), (1.0, 0.0), (2.0, 0.0)] {
    ///     assert!(switch.step(input, &mut state) && state[0] == expected);
    /// }
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, state: &mut [N; 2]) -> bool {
        let [_, on] = *state;
        let above = input.select(self.upper, on, one());
        let on = self.lower.select(input, above, N::whole(0));
        let [off_output, on_output] = self.levels;
        let output = half::<N>().select(on, on_output, off_output);
        store(state, [output, on], &[input])
    }
}
