//! The noninteracting law: partial feedback linearisation of one output per input.

use crate::feedback::combine;
use crate::{Channel, Gain, Real};

/// Measurements and other inputs of the law, one entry per channel.
#[derive(Debug, Clone, Copy)]
pub struct Measurement<'a, T> {
    /// Reduced coordinates of the design model, then their speeds.
    pub state: &'a [T],
    /// Output angles, rad.
    pub positions: &'a [T],
    /// Output speeds, rad/s.
    pub speeds: &'a [T],
    /// References: rad for a position channel, N m for a torque channel.
    pub references: &'a [T],
    /// Estimated load torques, N m.
    pub loads: &'a [T],
}

/// Noninteracting control by partial feedback linearisation, `[diss. 6.3.3]`: `u = Kx·x + Ku·v`, where `v` are the
/// requested accelerations of the outputs. With the designed gains each output is a double integrator of its own `v`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noninteracting<'a, T> {
    /// Kx, one row per input, N m per rad and per rad/s.
    pub state_gain: Gain<'a, T>,
    /// Ku, one row per input, N m per rad/s².
    pub acceleration_gain: Gain<'a, T>,
    /// The channels.
    pub channels: &'a [Channel<T>],
}

impl<T: Real> Noninteracting<'_, T> {
    /// One evaluation. `accelerations` is memory for v, one entry per channel; `torques` receives u, N m.
    ///
    /// Returns false and leaves `torques` unchanged if an input or a result is not finite.
    #[inline]
    #[must_use = "false: the torques are those of the last step"]
    pub fn torques(&self, measured: Measurement<'_, T>, accelerations: &mut [T], torques: &mut [T]) -> bool {
        let orders = measured.references.iter().zip(measured.loads);
        let motions = measured.positions.iter().zip(measured.speeds);
        for (((channel, v), (reference, load)), (position, speed)) in
            self.channels.iter().zip(accelerations.iter_mut()).zip(orders).zip(motions)
        {
            let Some(acceleration) = channel.acceleration(*reference, *position, *speed, *load) else { return false };
            *v = acceleration;
        }
        combine((&self.state_gain, measured.state), (&self.acceleration_gain, accelerations), torques)
    }
}
