use crate::{Gain, PositionLoop, Real};

/// What one decoupled channel does with its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Channel<T> {
    /// The output follows a position reference.
    Position {
        /// The loop around the double integrator.
        position_loop: PositionLoop<T>,
        /// Inverse of the inertia seen along the output, 1/(kg m²).
        inverse_inertia: T,
    },
    /// The reference is a torque that acts along the output, as if the output carried its effective inertia alone.
    Torque {
        /// Inverse of the inertia seen along the output, 1/(kg m²).
        inverse_inertia: T,
    },
}

/// What the law measures and is told, one entry per channel.
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
/// accelerations asked of the outputs. With the designed gains each output is a double integrator of its own `v`.
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
    #[inline]
    pub fn torques(&self, measured: Measurement<'_, T>, accelerations: &mut [T], torques: &mut [T]) {
        let told = measured.references.iter().zip(measured.loads);
        let seen = measured.positions.iter().zip(measured.speeds);
        for (((channel, v), (reference, load)), (position, speed)) in
            self.channels.iter().zip(accelerations.iter_mut()).zip(told).zip(seen)
        {
            *v = match channel {
                Channel::Position { position_loop, inverse_inertia } => {
                    position_loop.acceleration(*reference, *position, *speed, *load * *inverse_inertia)
                }
                Channel::Torque { inverse_inertia } => (*reference - *load) * *inverse_inertia,
            };
        }
        torques.fill(T::ZERO);
        self.state_gain.add_to(measured.state, torques);
        self.acceleration_gain.add_to(accelerations, torques);
    }
}
