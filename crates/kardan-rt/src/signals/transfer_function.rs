//! The block of a sampled transfer function.

use super::{half, one, zero, zero_or_nan};
use crate::Arithmetic;
use crate::dense::at;

/// A sampled transfer function `(b₀ + b₁ z⁻¹ + …)/(1 + a₁ z⁻¹ + …)`: filters, leads and lags (direct form II, transposed).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TransferFunction<'a, N> {
    /// b₀, b₁, …; missing coefficients are zero.
    pub numerator: &'a [N],
    /// a₁, a₂, …; missing coefficients are zero.
    pub denominator: &'a [N],
}

impl<N: Arithmetic> TransferFunction<'_, N> {
    /// One sample. The memory contains the output and then the states, as many as the longer one of the lists needs.
    /// Returns false and leaves the memory unchanged where the input or a result is not a number.
    ///
    /// ```
    /// // A low pass with 1/e after ten samples.
    /// let decay = (-0.1_f64).exp();
    /// let filter = kardan_rt::TransferFunction { numerator: &[0.0, 1.0 - decay], denominator: &[-decay] };
    /// let mut state = [0.0; 2];
    /// for _ in 0..=10 {
    ///     assert!(filter.step(1.0, &mut state));
    /// }
    /// assert!((state[0] - (1.0 - (-1.0_f64).exp())).abs() < 1e-15);
    /// ```
    #[must_use = "false: the output is that of the sample before"]
    pub fn step(&self, input: N, state: &mut [N]) -> bool {
        let Some((output, states)) = state.split_first_mut() else { return input.all_finite() };
        let now = at(self.numerator, 0) * input + at(states, 0);
        let new = |k: usize, later: Option<&N>| {
            let (b, a) = (at(self.numerator, k.saturating_add(1)), at(self.denominator, k));
            b * input - a * now + later.map_or(zero(), |x| *x)
        };
        let all = || states.iter().skip(1).map(Some).chain(core::iter::once(None)).enumerate().take(states.len());
        let nan_sum =
            all().fold(zero_or_nan(input) + zero_or_nan(now), |sum: N, (k, later)| sum + zero_or_nan(new(k, later)));
        let stays = nan_sum.finite_or(one());
        // States move up: each is overwritten only after the one before has read it.
        let mut k = 0usize;
        let mut rest: &mut [N] = states;
        while let Some((own, later)) = rest.split_first_mut() {
            *own = half::<N>().select(stays, *own, new(k, later.first()));
            k = k.saturating_add(1);
            rest = later;
        }
        *output = half::<N>().select(stays, *output, now);
        nan_sum.all_finite()
    }
}
