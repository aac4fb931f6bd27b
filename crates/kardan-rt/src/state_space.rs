//! A linear block in state space.

use crate::dense::{all_finite, copy};
use crate::feedback::combine;
use crate::{Gain, Real};

/// A linear dynamic block over a signal vector s, with states ξ and outputs u:
/// `ξ̇ = A ξ + B s` (continuous) or `ξ⁺ = A ξ + B s` (sampled), `u = C ξ + D s`.
///
/// Dynamic controllers (s = measurements and references), trajectory planners (s = references) and observers are such
/// blocks. An observer has the signals `s = [u; y]`, torques commanded and sensor readings: for the sampled plant
/// `x⁺ = Φ x + Γ u`, `y = C x` and the gain L it is `A = Φ − L C`, `B = [Γ L]`, and its state is the estimate of x.
/// A static gain is a block without states.
///
/// Which of the two the matrices describe is known to who designed them: [`rates`](Self::rates) belongs to the first
/// kind, [`step`](Self::step) to the second.
///
/// ```
/// use kardan_rt::StateSpace;
/// // A reference filter with a corner of 2 rad/s, sampled at 0.1 s by the exact discretisation e^{−0.2}.
/// let decay = (-0.2_f64).exp();
/// let (a, b) = ([decay], [1.0 - decay]);
/// let filter = StateSpace::new(&a, &b, &[1.0], &[0.0], 1, 1).unwrap();
/// let (mut state, mut next, mut out) = ([0.0], [0.0], [0.0]);
/// for _ in 0..10 {
///     assert!(filter.step(&mut state, &[1.0], &mut next));
/// }
/// assert!(filter.outputs(&state, &[1.0], &mut out));
/// assert!((out[0] - (1.0 - (-2.0_f64).exp())).abs() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateSpace<'a, T> {
    a: Gain<'a, T>,
    b: Gain<'a, T>,
    c: Gain<'a, T>,
    d: Gain<'a, T>,
}

impl<'a, T: Real> StateSpace<'a, T> {
    /// A block from its matrices, row by row: A (states × states), B (states × signals), C (outputs × states), D
    /// (outputs × signals); `None` if the lengths are inconsistent.
    ///
    /// ```
    /// use kardan_rt::StateSpace;
    /// // u = 3 s1 − s2, no states.
    /// let gain = StateSpace::new(&[], &[], &[], &[3.0, -1.0], 0, 2).unwrap();
    /// let mut out = [0.0];
    /// assert!(gain.outputs(&[], &[2.0, 5.0], &mut out));
    /// assert_eq!(out, [1.0]);
    /// // The block reports a reading that is not a number, and the last output stays.
    /// assert!(!gain.outputs(&[], &[2.0, f64::NAN], &mut out));
    /// assert_eq!(out, [1.0]);
    /// assert!(StateSpace::new(&[1.0], &[1.0], &[], &[], 2, 1).is_none());
    /// ```
    pub fn new(a: &'a [T], b: &'a [T], c: &'a [T], d: &'a [T], states: usize, signals: usize) -> Option<Self> {
        let outputs = d.len().checked_div(signals).or_else(|| c.len().checked_div(states))?;
        let fits = |matrix: &[T], rows: usize, columns: usize| rows.checked_mul(columns) == Some(matrix.len());
        let all = fits(a, states, states)
            && fits(b, states, signals)
            && fits(c, outputs, states)
            && fits(d, outputs, signals);
        // A matrix without columns has no entries, whatever the number of its rows.
        let gain = |matrix: &'a [T], columns: usize| Gain::new(matrix, columns.max(1));
        if !all {
            return None;
        }
        Some(Self { a: gain(a, states)?, b: gain(b, signals)?, c: gain(c, states)?, d: gain(d, signals)? })
    }

    /// `out = C ξ + D s`.
    ///
    /// Returns false and leaves `out` unchanged if an input or an output is not finite.
    #[inline]
    #[must_use = "false: the outputs are those of the last step"]
    pub fn outputs(&self, state: &[T], signals: &[T], out: &mut [T]) -> bool {
        combine((&self.c, state), (&self.d, signals), out)
    }

    /// `out = A ξ + B s`: the derivative of the state of a continuous block (per second), the next state of a sampled one.
    ///
    /// Returns false and leaves `out` unchanged if an input or an output is not finite.
    #[inline]
    #[must_use = "false: the rates are those of the last step"]
    pub fn rates(&self, state: &[T], signals: &[T], out: &mut [T]) -> bool {
        combine((&self.b, signals), (&self.a, state), out)
    }

    /// One sample: `ξ ← A ξ + B s`. `next` is memory, one entry per state.
    ///
    /// Returns whether the signals and the new state are finite; otherwise (a reading was NaN) the old state stays, so
    /// that one bad sample does not stay in the block for ever.
    #[inline]
    #[must_use = "false: the sample was dropped"]
    pub fn step(&self, state: &mut [T], signals: &[T], next: &mut [T]) -> bool {
        next.fill(T::ZERO);
        // The state last: that shortens the dependence of one step on the previous one.
        self.b.accumulate(signals, next);
        self.a.accumulate(state, next);
        let finite = all_finite(next) && all_finite(signals);
        if finite {
            copy(next, state);
        }
        finite
    }
}
