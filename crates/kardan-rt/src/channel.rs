//! How a channel of a decoupling law uses its reference.

use crate::dense::finite;
use crate::{PositionLoop, Real};

/// How a decoupled channel uses its reference.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Channel<T> {
    /// The output follows a position reference.
    Position {
        /// The loop around the double integrator.
        position_loop: PositionLoop<T>,
        /// Inverse of the effective inertia along the output, 1/(kg m²).
        inverse_inertia: T,
    },
    /// The reference is a torque on the output, as if the output had its effective inertia alone.
    Torque {
        /// Inverse of the effective inertia along the output, 1/(kg m²).
        inverse_inertia: T,
    },
}

impl<T: Real> Channel<T> {
    /// The acceleration to request of the output, rad/s²: (6.137) of the source for a position (rad),
    /// `(reference − load)/J` as in (6.131) for a torque (N m); position in rad, speed in rad/s, load in N m. `None`
    /// where that is not finite: use the previous request then. All four arguments are checked, also those that the
    /// kind of channel does not use.
    ///
    /// ```
    /// let wheel = kardan_rt::Channel::Torque { inverse_inertia: 4.0 };
    /// assert_eq!(wheel.acceleration(1.5, 0.3, -2.0, 0.5), Some(4.0));
    /// assert_eq!(wheel.acceleration(1.5, 0.3, f64::NAN, 0.5), None);
    /// ```
    #[inline]
    pub fn acceleration(&self, reference: T, position: T, speed: T, load: T) -> Option<T> {
        match self {
            Self::Position { position_loop, inverse_inertia } => {
                position_loop.acceleration(reference, position, speed, load * *inverse_inertia)
            }
            Self::Torque { inverse_inertia } => {
                finite((reference - load) * *inverse_inertia).filter(|_| position.is_finite() && speed.is_finite())
            }
        }
    }
}
