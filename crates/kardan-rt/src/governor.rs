//! A reference governor that keeps predicted commands within their bounds.

use crate::{Gain, Real};

/// A reference governor: each reference moves towards its request only as far as the commands, predicted for a constant
/// reference, stay within the bounds (Gilbert, Kolmanovsky, Tan 1995).
///
/// The prediction is `P [x̂; ξ; r]`, one row for each motor and predicted instant. References are moved one after the
/// other: a reference that requests too much does not limit the others. A row that violates its bound already may not
/// get worse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Governor<'a, T> {
    /// Pₓ, predictions × states.
    pub on_state: Gain<'a, T>,
    /// Pξ, predictions × states of the reference model.
    pub on_model: Gain<'a, T>,
    /// Pᵣ, predictions × references.
    pub on_references: Gain<'a, T>,
    /// Bound of each prediction, N m.
    pub bounds: &'a [T],
}

impl<T: Real> Governor<'_, T> {
    /// Moves `references` towards the requested ones. Returns whether the governor limited one; a request or a
    /// prediction that is not finite leaves the reference unchanged.
    ///
    /// ```
    /// use kardan_rt::{Gain, Governor};
    /// // The only prediction is twice the reference; it must stay within 1.
    /// let none = Gain::new(&[], 1).unwrap();
    /// let governor = Governor {
    ///     on_state: none, on_model: none, on_references: Gain::new(&[2.0], 1).unwrap(), bounds: &[1.0],
    /// };
    /// let mut reference = [0.1];
    /// assert!(governor.govern(&[], &[], &[3.0], &mut reference));
    /// assert_eq!(reference, [0.5]);
    /// ```
    pub fn govern(&self, state: &[T], model: &[T], desired: &[T], references: &mut [T]) -> bool {
        let mut governed = false;
        for k in 0..references.len().min(desired.len()) {
            let (Some(from), Some(to)) = (references.get(k).copied(), desired.get(k).copied()) else { continue };
            let change = to - from;
            if !change.is_finite() {
                governed = true;
                continue;
            }
            if !(change.abs() > T::ZERO) {
                continue;
            }
            let mut share = T::ONE;
            for (row, bound) in self.bounds.iter().enumerate() {
                let slope = self.on_references.entry(row, k) * change;
                let at_start = self.on_state.row_times(row, state)
                    + self.on_model.row_times(row, model)
                    + self.on_references.row_times(row, references);
                let (value, slope) = if slope < T::ZERO { (-at_start, -slope) } else { (at_start, slope) };
                // value + share * slope ≤ bound
                let room = if value.is_finite() { *bound - value } else { T::ZERO };
                let most = if room > T::ZERO { room } else { T::ZERO };
                if slope > T::ZERO && share * slope > most {
                    share = most / slope;
                }
            }
            if share < T::ONE {
                governed = true;
            }
            let moved = from + share * change;
            if let (Some(reference), true) = (references.get_mut(k), moved.is_finite()) {
                *reference = if share < T::ONE { moved } else { to };
            }
        }
        governed
    }
}
