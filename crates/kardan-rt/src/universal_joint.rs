use crate::Real;
use crate::dense::all_finite;
use crate::functions::{atan, sin_cos};

/// The transmission of a universal joint, `tan(y + phase_out) = C tan(x + phase_in)`, continuous over any number of
/// turns, `[diss. (6.99)-(6.106)]`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UniversalJoint<T> {
    /// C, above zero.
    pub ratio: T,
    /// Added to the argument, rad.
    pub phase_in: T,
    /// Taken from the value, rad.
    pub phase_out: T,
}

/// A curve y = γ(x) at one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurvePoint<T> {
    /// γ, rad.
    pub value: T,
    /// γ′.
    pub slope: T,
    /// γ″, 1/rad.
    pub curvature: T,
}

impl<T: Real> UniversalJoint<T> {
    /// Value, slope and curvature at x, rad, from one sine and cosine; `None` where one of them is no finite number.
    ///
    /// With θ = x + phase_in and `r = cos²θ + C² sin²θ`: `γ′ = C/r` (6.106), `γ″ = −2 C (C²−1) sin θ cos θ/r²`, and
    /// `γ + phase_out − θ = atan((C−1) sin θ cos θ/(cos²θ + C sin²θ))`, which never leaves ±π/2.
    ///
    /// ```
    /// let joint = kardan_rt::UniversalJoint { ratio: 0.5_f64, phase_in: 0.0, phase_out: 0.0 };
    /// let point = joint.at(0.7).unwrap();
    /// assert!((point.value.tan() - 0.5 * 0.7_f64.tan()).abs() < 1e-15);
    /// ```
    #[inline]
    pub fn at(&self, x: T) -> Option<CurvePoint<T>> {
        let (theta, c) = (x + self.phase_in, self.ratio);
        let (sin, cos) = sin_cos(theta);
        let (sin_sin, product, cos_cos) = (sin * sin, sin * cos, cos * cos);
        let r = cos_cos + c * c * sin_sin;
        let lead = atan((c - T::ONE) * product / (cos_cos + c * sin_sin));
        let (value, slope) = (theta + lead - self.phase_out, c / r);
        let curvature = -(c * (c * c - T::ONE)) * (product + product) / (r * r);
        all_finite(&[value, slope, curvature]).then_some(CurvePoint { value, slope, curvature })
    }
}
