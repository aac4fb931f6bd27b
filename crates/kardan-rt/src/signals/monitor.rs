//! The block of a monitor of a residual.

use super::{half, one, smaller, store, zero};
use crate::Arithmetic;

/// Monitors a residual: raises an alarm while it stays above its threshold, and ends the alarm once it stays below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Monitor<N> {
    /// The largest size of the residual that is no alarm.
    pub threshold: N,
    /// Number of consecutive samples above the threshold that raise an alarm; at least one.
    pub debounce: N,
    /// Number of consecutive samples within the threshold that end an alarm; infinity latches the alarm.
    pub hold: N,
}

impl<N: Arithmetic> Monitor<N> {
    /// Entries of its memory: whether there is an alarm (1, else 0), and the number of consecutive samples against that
    /// state.
    pub const STATES: usize = 2;

    /// One sample. A residual that is not a number counts as above the threshold, and the block returns false.
    ///
    /// ```
    /// let watch = kardan_rt::Monitor { threshold: 1.0, debounce: 2.0, hold: 3.0 };
    /// let mut state = [0.0; 2];
    /// let residuals = [0.5, -2.0, 0.1, 2.0, 3.0, 0.0, 0.0, -5.0, 0.0, 0.0, 0.0];
    /// let alarms = residuals.map(|residual| watch.step(residual, &mut state).then_some(state[0]).unwrap());
    /// assert_eq!(alarms, [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 0.0]);
    /// ```
    #[must_use = "false: the residual was not a number"]
    pub fn step(&self, residual: N, state: &mut [N; 2]) -> bool {
        let [alarm, count] = *state;
        // Not within the threshold: above it, or not a number.
        let size = residual.select(zero(), -residual, residual);
        let in_limits = self.threshold.select(size, zero(), one());
        let in_limits = in_limits * residual.is_number();
        let against = half::<N>().select(alarm, in_limits, one::<N>() - in_limits);
        let needed = half::<N>().select(alarm, self.hold, self.debounce);
        let count = half::<N>().select(against, count + one(), zero());
        let changes = count.select(needed, zero(), one());
        let changes = half::<N>().select(against, changes, zero());
        let alarm = half::<N>().select(changes, one::<N>() - alarm, alarm);
        // A count that continues for ever stops where numbers are no longer exact.
        let count = smaller(half::<N>().select(changes, zero(), count), N::whole(1 << 24));
        store(state, [alarm, count], &[]) & residual.all_finite()
    }
}
