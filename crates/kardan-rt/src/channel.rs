use crate::{PositionLoop, Real};

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

impl<T: Real> Channel<T> {
    /// The acceleration to ask of the output, rad/s²: (6.137) of the source for a position (rad), `(reference − load)/J`
    /// as in (6.131) for a torque (N m); position in rad, speed in rad/s, load in N m.
    ///
    /// ```
    /// let wheel = kardan_rt::Channel::Torque { inverse_inertia: 4.0 };
    /// assert_eq!(wheel.acceleration(1.5, 0.3, -2.0, 0.5), 4.0);
    /// ```
    #[inline]
    pub fn acceleration(&self, reference: T, position: T, speed: T, load: T) -> T {
        match self {
            Self::Position { position_loop, inverse_inertia } => {
                position_loop.acceleration(reference, position, speed, load * *inverse_inertia)
            }
            Self::Torque { inverse_inertia } => (reference - load) * *inverse_inertia,
        }
    }
}
