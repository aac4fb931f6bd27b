//! Floating point with an exponent that does not overflow, and complex numbers of any precision, for the isolation of
//! roots.

use dashu_int::ops::BitTest;
use dashu_int::{IBig, UBig};
use kardan_rt::functions::log2;

use super::{Rational, rational_to_f64};

/// Bits of a double's significand.
const BITS: i64 = 52;

/// 2ᵏ; zero far below the range of doubles.
fn power(k: i64) -> f64 {
    if k < -1000 { 0.0 } else { f64::from_bits(((k.min(1000) + 1023) as u64) << BITS) }
}

/// k with `2ᵏ ≤ x < 2ᵏ⁺¹`, for a normal x > 0.
fn logarithm(x: f64) -> i64 {
    ((x.to_bits() >> BITS) & 0x7ff) as i64 - 1023
}

/// A size, `mantissa · 2^exponent`, with the mantissa 0 or from 1 to below 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Size {
    mantissa: f64,
    exponent: i64,
}

impl Size {
    pub const ZERO: Self = Self { mantissa: 0.0, exponent: i64::MIN / 4 };
    pub const ONE: Self = Self { mantissa: 1.0, exponent: 0 };
    /// Beyond any other.
    pub const LARGEST: Self = Self { mantissa: 1.0, exponent: i64::MAX / 4 };

    /// `mantissa · 2^exponent` with a finite mantissa ≥ 0 that is not subnormal.
    pub fn new(mantissa: f64, exponent: i64) -> Self {
        if mantissa == 0.0 {
            return Self::ZERO;
        }
        let shift = logarithm(mantissa);
        Self { mantissa: mantissa * power(-shift), exponent: exponent + shift }
    }

    pub fn is_zero(self) -> bool {
        self.mantissa == 0.0
    }

    pub fn plus(self, other: Self) -> Self {
        let (large, small) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        Self::new(large.mantissa + small.mantissa * power(small.exponent - large.exponent), large.exponent)
    }

    pub fn times(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        Self::new(self.mantissa * other.mantissa, self.exponent + other.exponent)
    }

    /// Beyond any other size over zero.
    pub fn over(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (true, _) => Self::ZERO,
            (false, true) => Self::LARGEST,
            _ => Self::new(self.mantissa / other.mantissa, self.exponent - other.exponent),
        }
    }

    /// `self − other`; zero if that is negative.
    pub fn less(self, other: Self) -> Self {
        if self <= other {
            return Self::ZERO;
        }
        Self::new(self.mantissa - other.mantissa * power(other.exponent - self.exponent), self.exponent)
    }

    /// Times `factor · 2^shift`.
    pub fn scaled(self, factor: f64, shift: i64) -> Self {
        if self.is_zero() { self } else { Self::new(self.mantissa * factor, self.exponent + shift) }
    }

    /// log₂; far below any other for zero.
    pub fn log2(self) -> f64 {
        log2(self.mantissa) + self.exponent as f64
    }

    /// The nearest double, if it is in their range.
    pub fn to_f64(self) -> Option<f64> {
        match self.exponent {
            _ if self.is_zero() => Some(0.0),
            ..-900 => Some(0.0),
            901.. => None,
            exponent => Some(self.mantissa * power(exponent)),
        }
    }
}

impl PartialOrd for Size {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.exponent.cmp(&other.exponent).then(self.mantissa.total_cmp(&other.mantissa)).into()
    }
}

/// A complex number of double precision, `(re + j im) · 2^exponent`, the larger part from 1 to below 2 or both zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wide {
    pub re: f64,
    pub im: f64,
    pub exponent: i64,
}

impl Wide {
    pub const ZERO: Self = Self { re: 0.0, im: 0.0, exponent: i64::MIN / 4 };
    pub const ONE: Self = Self { re: 1.0, im: 0.0, exponent: 0 };

    pub fn new(re: f64, im: f64, exponent: i64) -> Self {
        let largest = re.abs().max(im.abs());
        if largest == 0.0 {
            return Self::ZERO;
        }
        let shift = logarithm(largest);
        let scale = power(-shift);
        Self { re: re * scale, im: im * scale, exponent: exponent + shift }
    }

    pub fn is_zero(self) -> bool {
        self.re == 0.0 && self.im == 0.0
    }

    pub fn minus(self, other: Self) -> Self {
        self.plus(Self { re: -other.re, im: -other.im, ..other })
    }

    pub fn plus(self, other: Self) -> Self {
        let (large, small) = if self.exponent >= other.exponent { (self, other) } else { (other, self) };
        let scale = power(small.exponent - large.exponent);
        Self::new(large.re + small.re * scale, large.im + small.im * scale, large.exponent)
    }

    pub fn times(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self::ZERO;
        }
        let (re, im) = (self.re * other.re - self.im * other.im, self.re * other.im + self.im * other.re);
        Self::new(re, im, self.exponent + other.exponent)
    }

    /// `self / other`; the other one must not be zero.
    pub fn over(self, other: Self) -> Self {
        let size = other.re * other.re + other.im * other.im;
        let inverse = Self { re: other.re / size, im: -other.im / size, exponent: -other.exponent };
        self.times(inverse)
    }

    pub fn size(self) -> Size {
        Size::new((self.re * self.re + self.im * self.im).sqrt(), self.exponent)
    }
}

/// A complex number `(x + j y) · 2^exponent` of any precision.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Point {
    pub x: IBig,
    pub y: IBig,
    pub exponent: i64,
}

/// The highest bits of a whole number as a double.
fn leading(x: &IBig, shift: usize) -> f64 {
    let top = if shift == 0 { i64::try_from(x) } else { i64::try_from(&(x >> shift)) };
    top.unwrap_or(0) as f64
}

/// `x · 2ᵏ` for any k ≥ 0.
fn shifted(x: &IBig, k: i64) -> IBig {
    x << usize::try_from(k).unwrap_or(0)
}

impl Point {
    pub fn real(x: IBig, exponent: i64) -> Self {
        Self { x, y: IBig::ZERO, exponent }
    }

    /// The number itself but for what lies below 2⁻⁶⁰ of its size.
    pub fn from_wide(z: Wide) -> Self {
        let whole = |x: f64| IBig::from((x * power(60)) as i64);
        Self { x: whole(z.re), y: whole(z.im), exponent: z.exponent - 60 }
    }

    /// Bits of the larger part.
    pub fn bits(&self) -> usize {
        self.x.bit_len().max(self.y.bit_len())
    }

    pub fn is_zero(&self) -> bool {
        self.x.is_zero() && self.y.is_zero()
    }

    /// To double precision; each part is off by at most 2⁻⁵² of the larger one.
    pub fn wide(&self) -> Wide {
        let shift = self.bits().saturating_sub(62);
        Wide::new(leading(&self.x, shift), leading(&self.y, shift), self.exponent + shift as i64)
    }

    /// Cut to this many bits of the larger part; off by at most 2^(1.5 − bits) of its size.
    pub fn cut(mut self, bits: usize) -> Self {
        let shift = self.bits().saturating_sub(bits);
        if shift > 0 {
            self.x >>= shift;
            self.y >>= shift;
            self.exponent += shift as i64;
        }
        self
    }

    /// The exact sum.
    pub fn plus(&self, other: &Self) -> Self {
        let exponent = match (self.is_zero(), other.is_zero()) {
            (true, _) => return other.clone(),
            (_, true) => return self.clone(),
            _ => self.exponent.min(other.exponent),
        };
        let part = |a: &IBig, b: &IBig| shifted(a, self.exponent - exponent) + shifted(b, other.exponent - exponent);
        Self { x: part(&self.x, &other.x), y: part(&self.y, &other.y), exponent }
    }

    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&Self { x: -&other.x, y: -&other.y, exponent: other.exponent })
    }

    /// The product with another one, exact.
    pub fn times(&self, other: &Self) -> Self {
        Self {
            x: &self.x * &other.x - &self.y * &other.y,
            y: &self.x * &other.y + &self.y * &other.x,
            exponent: self.exponent + other.exponent,
        }
    }

    /// Position of the highest bit.
    fn top(&self) -> i64 {
        self.bits() as i64 + self.exponent
    }

    /// The sum, cut to this many bits; off by at most 2^(2 − bits) of its size. A part far below the other is dropped.
    pub fn sum(self, other: &Self, bits: usize) -> Self {
        let gap = bits as i64 + 4;
        let sum = if other.is_zero() {
            self
        } else if self.is_zero() || self.top() < other.top() - gap {
            other.clone()
        } else if other.top() < self.top() - gap {
            self
        } else {
            self.plus(other)
        };
        sum.cut(bits)
    }
}

/// `x · 2^exponent` as the nearest double; neither zero nor infinite unless x is zero.
pub(super) fn nearest(x: &IBig, exponent: i64) -> f64 {
    if x.is_zero() {
        return 0.0;
    }
    let sign = if *x < IBig::ZERO { -1.0 } else { 1.0 };
    let size = match x.bit_len() as i64 + exponent {
        ..-1080 => 0.0,
        1025.. => f64::INFINITY,
        _ if exponent >= 0 => rational_to_f64(&Rational::from(shifted(x, exponent))).abs(),
        _ => rational_to_f64(&Rational::from_parts(x.clone(), UBig::ONE << exponent.unsigned_abs() as usize)).abs(),
    };
    sign * size.clamp(f64::from_bits(1), f64::MAX)
}

#[cfg(test)]
#[path = "../../tests/unit/num/wide.rs"]
mod tests;
