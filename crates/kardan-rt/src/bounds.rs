//! Limits of the torque of a motor and of its change per sample.

use crate::Real;

/// The limits of a motor: torques within ± `torque`, changes within ± `change` from one sample to the next, N m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds<T> {
    /// Largest torque either way, N m; `None`: unlimited.
    pub torque: Option<T>,
    /// Largest change per sample either way, N m; `None`: unlimited.
    pub change: Option<T>,
}

impl<T: Real> Bounds<T> {
    /// The torque within the bounds that is nearest to the requested one; the previous torque where that is not finite
    /// (the request is NaN, or infinite without a bound). If the previous torque is within the bounds, so is the
    /// result; a result that differs from the request shows that a bound was active.
    ///
    /// ```
    /// use kardan_rt::Bounds;
    /// let motor = Bounds { torque: Some(1.3), change: Some(0.5) };
    /// assert_eq!(motor.nearest(2.0, 1.0), 1.3);
    /// assert_eq!(motor.nearest(-2.0, 1.0), 0.5);
    /// assert_eq!(motor.nearest(f64::NAN, 1.0), 1.0);
    /// assert_eq!(Bounds { torque: None, change: None }.nearest(f64::INFINITY, 1.0), 1.0);
    /// ```
    #[inline]
    pub fn nearest(&self, command: T, before: T) -> T {
        let mut out = command;
        if let Some(change) = self.change {
            out = clamped(out, before - change, before + change);
        }
        if let Some(torque) = self.torque {
            out = clamped(out, -torque, torque);
        }
        if out.is_finite() { out } else { before }
    }
}

/// The nearest number between two; NaN stays.
#[inline]
fn clamped<T: Real>(x: T, low: T, high: T) -> T {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}
