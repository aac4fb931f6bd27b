//! The block of a sampled linear observer.

use super::{half, one, zero, zero_or_nan};
use crate::Arithmetic;
use crate::dense::{dot, row};

/// A sampled linear observer: `x⁺ = A x + B u + L (y − C x)`, with the estimate x of the state of a plant with inputs u
/// and measurements y.
///
/// Its output at a sample was predicted at the previous one, so it does not depend on the measurements of that sample
/// and may close a loop. Matrices are stored row by row; missing entries are zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observer<'a, N> {
    /// A, states × states.
    pub a: &'a [N],
    /// B, states × inputs.
    pub b: &'a [N],
    /// C, measurements × states.
    pub c: &'a [N],
    /// L, states × measurements.
    pub gain: &'a [N],
}

impl<N: Arithmetic> Observer<'_, N> {
    /// One sample. The memory contains the estimate for this sample, then that for the next one: two entries for each
    /// state. Returns false and leaves the memory unchanged where an input, a measurement or a result is not a number.
    ///
    /// ```
    /// // A constant, measured directly: half of the error remains after each sample.
    /// let constant = kardan_rt::Observer { a: &[1.0], b: &[], c: &[1.0], gain: &[0.5] };
    /// let mut memory = [0.0; 2];
    /// for expected in [0.0, 4.0, 6.0, 7.0, 7.5] {
    ///     assert!(constant.step(&[], &[8.0], &mut memory) && memory[0] == expected);
    /// }
    /// ```
    #[must_use = "false: the estimate is that of the sample before"]
    pub fn step(&self, inputs: &[N], measured: &[N], memory: &mut [N]) -> bool {
        let Some((estimates, states)) = memory.split_at_mut_checked(memory.len() >> 1) else { return false };
        let count = estimates.len();
        let residual = |k: usize, y: N, x: &[N]| y - dot(row(self.c, k, count), x);
        let next = |i: usize, x: &[N]| {
            let gains = row(self.gain, i, measured.len()).iter().zip(measured).enumerate();
            let foretold = dot(row(self.a, i, count), x) + dot(row(self.b, i, inputs.len()), inputs);
            gains.fold(foretold, |sum, (k, (gain, y))| sum + *gain * residual(k, *y, x))
        };
        let nan_of_inputs = inputs.iter().chain(measured).fold(zero(), |sum: N, x| sum + zero_or_nan(*x));
        let nan_sum = (0..count).fold(nan_of_inputs, |sum: N, i| sum + zero_or_nan(next(i, states)));
        let stays = nan_sum.finite_or(one());
        for (output, state) in estimates.iter_mut().zip(states.iter()) {
            *output = half::<N>().select(stays, *output, *state);
        }
        for (i, state) in states.iter_mut().enumerate() {
            *state = half::<N>().select(stays, *state, next(i, estimates));
        }
        nan_sum.all_finite()
    }
}
