//! Numbers, one or several side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};

use crate::Real;

/// The arithmetic of a signal block: a [`Number`], or an expression that a program records, so that the code of a block
/// is also its formula.
pub trait Arithmetic:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// A whole number.
    fn whole(count: usize) -> Self;
    /// `then` where `self < than`, else `otherwise`; for each lane separately.
    #[must_use]
    fn select(self, than: Self, then: Self, otherwise: Self) -> Self;
    /// This where it is finite, else `other`; for each lane separately.
    #[must_use]
    fn finite_or(self, other: Self) -> Self;
    /// 1 where this is a number, else 0; for each lane separately. Valid for an expression as long as the number is
    /// below 2⁵³.
    #[must_use]
    fn is_number(self) -> Self;
    /// Whether all lanes are finite.
    fn all_finite(self) -> bool;
}

/// The number type of a plan: a number of the target, or several of them in SIMD lanes ([`Lanes`]).
pub trait Number: Arithmetic {
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
    /// Whether the predicate is true in a lane.
    fn any(self, predicate: impl Fn(Self::One) -> bool) -> bool;
}

impl<T: Real> Arithmetic for T {
    #[inline]
    fn whole(count: usize) -> Self {
        T::count(count)
    }

    #[inline]
    fn select(self, than: Self, then: Self, otherwise: Self) -> Self {
        if self < than { then } else { otherwise }
    }

    #[inline]
    fn finite_or(self, other: Self) -> Self {
        if self.is_finite() { self } else { other }
    }

    #[inline]
    fn is_number(self) -> Self {
        if self.is_finite() { T::ONE } else { T::ZERO }
    }

    #[inline]
    fn all_finite(self) -> bool {
        self.is_finite()
    }
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
    fn any(self, predicate: impl Fn(T) -> bool) -> bool {
        predicate(self)
    }
}

/// Numbers side by side: an evaluation does all of them at once, with the bits of one after the other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(transparent)]
pub struct Lanes<T, const N: usize>(pub [T; N]);

/// An operator of two numbers in each lane.
macro_rules! lanewise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl<T: Real, const N: usize> $trait for Lanes<T, N> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, |a, b| a $operator b)
            }
        }
    };
}

lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);
lanewise!(Div, div, /);

impl<T: Real, const N: usize> Neg for Lanes<T, N> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|a| -a)
    }
}

impl<T: Real, const N: usize> Arithmetic for Lanes<T, N> {
    #[inline(always)]
    fn whole(count: usize) -> Self {
        Self([T::count(count); N])
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
    fn finite_or(self, other: Self) -> Self {
        self.zip(other, Arithmetic::finite_or)
    }

    #[inline(always)]
    fn is_number(self) -> Self {
        self.map(Arithmetic::is_number)
    }

    #[inline(always)]
    fn all_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
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
        let mut out = self;
        for (a, b) in out.0.iter_mut().zip(other.0) {
            *a = function(*a, b);
        }
        out
    }

    #[inline(always)]
    fn any(self, predicate: impl Fn(T) -> bool) -> bool {
        self.0.iter().any(|x| predicate(*x))
    }
}
