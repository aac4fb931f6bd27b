//! Numbers, one or several side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::Real;

/// What a plan computes with: a number of the target, or several of them side by side ([`Lanes`]).
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// The number of one lane.
    type One: Real;
    /// The same in all lanes.
    fn all(value: Self::One) -> Self;
    /// A function of each lane.
    #[must_use]
    fn map(self, function: impl Fn(Self::One) -> Self::One) -> Self;
    /// A function of each lane of both.
    #[must_use]
    fn zip(self, other: Self, function: impl Fn(Self::One, Self::One) -> Self::One) -> Self;
    /// `then` in lanes where `self < than`, else `otherwise`.
    #[must_use]
    fn select(self, than: Self, then: Self, otherwise: Self) -> Self;
    /// Whether something holds in a lane.
    fn any(self, holds: impl Fn(Self::One) -> bool) -> bool;
}

impl<T: Real> Number for T {
    type One = T;

    #[inline]
    fn all(value: T) -> Self {
        value
    }

    #[inline]
    fn map(self, function: impl Fn(T) -> T) -> Self {
        function(self)
    }

    #[inline]
    fn zip(self, other: Self, function: impl Fn(T, T) -> T) -> Self {
        function(self, other)
    }

    #[inline]
    fn select(self, than: Self, then: Self, otherwise: Self) -> Self {
        if self < than { then } else { otherwise }
    }

    #[inline]
    fn any(self, holds: impl Fn(T) -> bool) -> bool {
        holds(self)
    }
}

/// Numbers side by side: an evaluation does all of them at once, with the bits of one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Lanes<T, const N: usize>(pub [T; N]);

impl<T: Real, const N: usize> Lanes<T, N> {
    #[inline(always)]
    fn both(self, other: Self, function: impl Fn(T, T) -> T) -> Self {
        let mut out = self;
        for (a, b) in out.0.iter_mut().zip(other.0) {
            *a = function(*a, b);
        }
        out
    }
}

impl<T: Real, const N: usize> Add for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.both(other, |a, b| a + b)
    }
}

impl<T: Real, const N: usize> Sub for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.both(other, |a, b| a - b)
    }
}

impl<T: Real, const N: usize> Mul for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.both(other, |a, b| a * b)
    }
}

impl<T: Real, const N: usize> Div for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.both(other, |a, b| a / b)
    }
}

impl<T: Real, const N: usize> Neg for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<T: Real, const N: usize> Number for Lanes<T, N> {
    type One = T;

    #[inline(always)]
    fn all(value: T) -> Self {
        Self([value; N])
    }

    #[inline(always)]
    fn map(self, function: impl Fn(T) -> T) -> Self {
        let mut out = self;
        for a in &mut out.0 {
            *a = function(*a);
        }
        out
    }

    #[inline(always)]
    fn zip(self, other: Self, function: impl Fn(T, T) -> T) -> Self {
        self.both(other, function)
    }

    #[inline(always)]
    fn select(self, than: Self, then: Self, otherwise: Self) -> Self {
        let mut out = self;
        for (((a, than), then), otherwise) in out.0.iter_mut().zip(than.0).zip(then.0).zip(otherwise.0) {
            *a = if *a < than { then } else { otherwise };
        }
        out
    }

    #[inline(always)]
    fn any(self, holds: impl Fn(T) -> bool) -> bool {
        self.0.iter().any(|x| holds(*x))
    }
}
