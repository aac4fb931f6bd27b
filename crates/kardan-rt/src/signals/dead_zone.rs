//! The block of a dead zone.

use super::{store, zero};
use crate::Arithmetic;

/// A signal with a dead zone: zero inside the zone, straight outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeadZone<N> {
    /// Where it begins.
    pub low: N,
    /// Where it ends, not below its begin.
    pub high: N,
}

impl<N: Arithmetic> DeadZone<N> {
    /// Entries of its memory: the output.
    pub const STATES: usize = 1;

    /// `u − high` above the zone, `u − low` below it, else 0. Returns false and leaves the output unchanged where the
    /// input is not a number.
    ///
    /// ```
    /// let zone = kardan_rt::DeadZone { low: -1.0, high: 2.0 };
    /// let mut output = [0.0];
    /// for (input, expected) in [(3.0, 1.0), (2.0, 0.0), (-0.5, 0.0), (-4.0, -3.0)] {
    ///     assert!(zone.step(input, &mut output) && output == [expected]);
    /// }
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, state: &mut [N; 1]) -> bool {
        let below = input.select(self.low, input - self.low, zero());
        let output = self.high.select(input, input - self.high, below);
        store(state, [output], &[input])
    }
}
