use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::functions::{self, Format, far};

/// A floating-point number of the target: `f32` or `f64`.
///
/// Its [functions] are the same on every target, so that firmware and simulation compute the same bits.
pub trait Real:
    Format
    + Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// The distance from 1 to the next larger number.
    const EPSILON: Self;
    /// No number.
    const NAN: Self;
    /// √x, NaN below zero.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle in rad.
    fn sin_cos(self) -> (Self, Self);
    /// The tangent of an angle in rad.
    fn tan(self) -> Self;
    /// Whether an angle is so large that sine and tangent take their slow way.
    fn is_far(self) -> bool;
    /// The angle within ±π/2 rad whose sine this is, NaN beyond ±1.
    fn asin(self) -> Self;
    /// The angle from 0 to π rad whose cosine this is, NaN beyond ±1.
    fn acos(self) -> Self;
    /// The angle within ±π/2 rad whose tangent this is.
    fn atan(self) -> Self;
    /// The angle of the point (x, self), rad.
    fn atan2(self, x: Self) -> Self;
    /// eˣ
    fn exp(self) -> Self;
    /// The natural logarithm, NaN below zero.
    fn ln(self) -> Self;
    /// The largest whole number that is not above.
    fn floor(self) -> Self;
    /// The whole number towards zero; 0 below zero and for NaN, the largest there is where it is too large.
    fn whole(self) -> usize;
    /// The nearest number.
    fn count(whole: usize) -> Self;

    /// Whether this is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// The size without the sign.
    fn abs(self) -> Self;
}

impl Real for f32 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = Self::EPSILON;
    const NAN: Self = Self::NAN;

    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrtf(self)
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        if self.is_far() { far::sin_cos_single(self) } else { functions::sin_cos_near(self) }
    }

    #[inline]
    fn tan(self) -> Self {
        if self.is_far() { far::tan_single(self) } else { functions::tan_near(self) }
    }

    #[inline]
    fn is_far(self) -> bool {
        self.abs() > Self::NEAR
    }

    #[inline]
    fn asin(self) -> Self {
        functions::asin(self)
    }

    #[inline]
    fn acos(self) -> Self {
        functions::acos(self)
    }

    #[inline]
    fn atan(self) -> Self {
        functions::atan(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        functions::atan2(self, x)
    }

    #[inline]
    fn exp(self) -> Self {
        functions::exp(self)
    }

    #[inline]
    fn ln(self) -> Self {
        functions::ln(self)
    }

    #[inline]
    fn floor(self) -> Self {
        libm::floorf(self)
    }

    #[inline]
    #[allow(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss)] // as its contract says
    fn whole(self) -> usize {
        self as usize
    }

    #[inline]
    #[allow(clippy::as_conversions)] // to the nearest
    fn count(whole: usize) -> Self {
        whole as Self
    }

    #[inline]
    fn is_finite(self) -> bool {
        f32::is_finite(self)
    }

    #[inline]
    fn abs(self) -> Self {
        f32::abs(self)
    }
}

impl Real for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const EPSILON: Self = Self::EPSILON;
    const NAN: Self = Self::NAN;

    #[inline]
    fn sqrt(self) -> Self {
        libm::sqrt(self)
    }

    #[inline]
    fn sin_cos(self) -> (Self, Self) {
        if self.is_far() { far::sin_cos(self) } else { functions::sin_cos_near(self) }
    }

    #[inline]
    fn tan(self) -> Self {
        if self.is_far() { far::tan(self) } else { functions::tan_near(self) }
    }

    #[inline]
    fn is_far(self) -> bool {
        self.abs() > Self::NEAR
    }

    #[inline]
    fn asin(self) -> Self {
        functions::asin(self)
    }

    #[inline]
    fn acos(self) -> Self {
        functions::acos(self)
    }

    #[inline]
    fn atan(self) -> Self {
        functions::atan(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        functions::atan2(self, x)
    }

    #[inline]
    fn exp(self) -> Self {
        functions::exp(self)
    }

    #[inline]
    fn ln(self) -> Self {
        functions::ln(self)
    }

    #[inline]
    fn floor(self) -> Self {
        libm::floor(self)
    }

    #[inline]
    #[allow(clippy::as_conversions, clippy::cast_possible_truncation, clippy::cast_sign_loss)] // as its contract says
    fn whole(self) -> usize {
        self as usize
    }

    #[inline]
    #[allow(clippy::as_conversions)] // to the nearest
    fn count(whole: usize) -> Self {
        whole as Self
    }

    #[inline]
    fn is_finite(self) -> bool {
        f64::is_finite(self)
    }

    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
    }
}
