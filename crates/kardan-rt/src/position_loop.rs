//! A position loop on a double integrator with load feed-forward.

use crate::Real;
use crate::dense::finite;

/// A position loop on a double integrator with load feed-forward, `[diss. (6.137)]`:
/// `u = ω² (reference − position) − 2 ξ ω speed − load`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionLoop<T> {
    /// ω, rad/s.
    pub natural_frequency: T,
    /// ξ.
    pub damping_ratio: T,
}

impl<T: Real> PositionLoop<T> {
    /// The acceleration to request, rad/s², from reference and position (rad), speed (rad/s) and the estimated load as
    /// an acceleration (load torque over inertia, rad/s²); `None` where that is not finite (an input is not finite, or
    /// the result overflows): use the previous request then.
    ///
    /// ```
    /// let rack = kardan_rt::PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
    /// assert_eq!(rack.acceleration(1.0, 0.5, 0.0, 0.0), Some(200.0));
    /// assert_eq!(rack.acceleration(1.0, f64::NAN, 0.0, 0.0), None);
    /// ```
    #[inline]
    pub fn acceleration(&self, reference: T, position: T, speed: T, load: T) -> Option<T> {
        let omega = self.natural_frequency;
        let rate = self.damping_ratio * omega;
        finite(omega * omega * (reference - position) - (rate + rate) * speed - load)
    }
}
