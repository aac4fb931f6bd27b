//! The block of a delay by whole samples.

use super::zero;
use crate::Arithmetic;

/// A signal some samples later: as many as its memory is long, less one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Delay;

impl Delay {
    /// One sample: the output, which is the first entry of the memory, is the input as many samples ago as there are
    /// entries behind it; before that it is their start values. Where the input is not a number, the block returns
    /// false and uses the previous input.
    ///
    /// ```
    /// let mut state = [0.0; 3];
    /// let outputs = [1.0, 2.0, 3.0, 4.0].map(|input| kardan_rt::Delay.step(input, &mut state).then_some(state[0]));
    /// assert_eq!(outputs, [Some(0.0), Some(0.0), Some(1.0), Some(2.0)]);
    /// ```
    #[must_use = "false: the previous input replaces this one"]
    pub fn step<N: Arithmetic>(&self, input: N, state: &mut [N]) -> bool {
        let last = state.last().map_or(zero(), |last| *last);
        let mut later = input.finite_or(last);
        // The oldest entry becomes the output, the others move up, and the input is appended.
        for place in state.iter_mut().rev() {
            core::mem::swap(place, &mut later);
        }
        input.all_finite()
    }
}
