//! The floating-point numbers in which the blocks compute.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::format::Format;

/// A floating-point number of the target: `f32` or `f64`.
///
/// Its [functions](crate::functions) are the same on every target, so that firmware and simulation compute the same bits.
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
    /// NaN.
    const NAN: Self;
    /// √x, NaN below zero.
    fn sqrt(self) -> Self;
    /// The largest whole number that is not above.
    fn floor(self) -> Self;
    /// Truncation to an integer; 0 below zero and for NaN, the largest integer where it is too large.
    fn whole(self) -> usize;
    /// The nearest number.
    fn count(whole: usize) -> Self;

    /// Whether this is neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// The size without the sign.
    fn abs(self) -> Self;
}

/// A format as the number of the target, with its functions of libm.
macro_rules! real {
    ($number:ty, $sqrt:ident, $floor:ident) => {
        impl Real for $number {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = Self::EPSILON;
            const NAN: Self = Self::NAN;

            #[inline]
            fn sqrt(self) -> Self {
                // The root is exact either way; the compiler vectorises only its own.
                #[cfg(feature = "std")]
                return <$number>::sqrt(self);
                #[cfg(not(feature = "std"))]
                libm::$sqrt(self)
            }

            #[inline]
            fn floor(self) -> Self {
                libm::$floor(self)
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
                <$number>::is_finite(self)
            }

            #[inline]
            fn abs(self) -> Self {
                <$number>::abs(self)
            }
        }
    };
}

real!(f32, sqrtf, floorf);
real!(f64, sqrt, floor);
