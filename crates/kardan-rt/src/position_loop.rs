use crate::Real;

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
    /// The acceleration to ask for, rad/s², from reference and position (rad), speed (rad/s) and the estimated load
    /// as an acceleration (load torque over inertia, rad/s²).
    #[inline]
    pub fn acceleration(&self, reference: T, position: T, speed: T, load: T) -> T {
        let omega = self.natural_frequency;
        let rate = self.damping_ratio * omega;
        omega * omega * (reference - position) - (rate + rate) * speed - load
    }
}
