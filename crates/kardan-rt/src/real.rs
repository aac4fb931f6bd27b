use core::ops::{Add, Div, Mul, Neg, Sub};

/// A floating-point number of the target: `f32` or `f64`.
///
/// Functions come from the `libm` crate on every target, so that firmware and simulation compute the same bits.
pub trait Real:
    Copy
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
        libm::sincosf(self)
    }

    #[inline]
    fn atan(self) -> Self {
        libm::atanf(self)
    }

    #[inline]
    fn tan(self) -> Self {
        libm::tanf(self)
    }

    #[inline]
    fn asin(self) -> Self {
        libm::asinf(self)
    }

    #[inline]
    fn acos(self) -> Self {
        libm::acosf(self)
    }

    #[inline]
    fn exp(self) -> Self {
        libm::expf(self)
    }

    #[inline]
    fn ln(self) -> Self {
        libm::logf(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        libm::atan2f(self, x)
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
        libm::sincos(self)
    }

    #[inline]
    fn atan(self) -> Self {
        libm::atan(self)
    }

    #[inline]
    fn tan(self) -> Self {
        libm::tan(self)
    }

    #[inline]
    fn asin(self) -> Self {
        libm::asin(self)
    }

    #[inline]
    fn acos(self) -> Self {
        libm::acos(self)
    }

    #[inline]
    fn exp(self) -> Self {
        libm::exp(self)
    }

    #[inline]
    fn ln(self) -> Self {
        libm::log(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        libm::atan2(self, x)
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
