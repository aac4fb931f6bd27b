//! The numbers of matrices: exact fractions and doubles.

use dashu_int::ops::Gcd;
use dashu_int::{IBig, UBig};
use dashu_ratio::RBig;

/// An exact fraction of whole numbers of any size.
pub type Rational = RBig;

/// The operations that the matrix code needs of a number.
///
/// Implemented by `f64` and [`Rational`]. `Clone` is by value because a rational owns memory.
pub trait Scalar: Clone + PartialEq + std::fmt::Debug {
    /// 0.
    fn zero() -> Self;
    /// 1.
    fn one() -> Self;
    /// `self + other`.
    fn plus(&self, other: &Self) -> Self;
    /// `self − other`.
    fn minus(&self, other: &Self) -> Self;
    /// `self · other`.
    fn times(&self, other: &Self) -> Self;
    /// `self / other`; `other` must not be zero.
    fn over(&self, other: &Self) -> Self;
    /// Whether it is zero (exactly, also for `f64`).
    fn is_zero(&self) -> bool;
    /// From an exact fraction (rounded for `f64`).
    fn from_rational(value: &Rational) -> Self;
    /// To the nearest `f64`.
    fn to_f64(&self) -> f64;
}

/// The four operations of a number that has them as operators.
macro_rules! operators {
    ($($operation:ident $operator:tt),*) => {
        $(fn $operation(&self, other: &Self) -> Self {
            self $operator other
        })*
    };
}

impl Scalar for f64 {
    operators!(plus +, minus -, times *, over /);
    fn zero() -> Self {
        0.0
    }
    fn one() -> Self {
        1.0
    }
    fn is_zero(&self) -> bool {
        *self == 0.0
    }
    fn from_rational(value: &Rational) -> Self {
        rational_to_f64(value)
    }
    fn to_f64(&self) -> f64 {
        *self
    }
}

impl Scalar for Rational {
    operators!(plus +, minus -, times *, over /);
    fn zero() -> Self {
        RBig::ZERO
    }
    fn one() -> Self {
        RBig::ONE
    }
    fn is_zero(&self) -> bool {
        RBig::is_zero(self)
    }
    fn from_rational(value: &Rational) -> Self {
        value.clone()
    }
    fn to_f64(&self) -> f64 {
        rational_to_f64(self)
    }
}

/// The `f64` nearest to an exact fraction.
pub fn rational_to_f64(value: &Rational) -> f64 {
    value.to_f64().value()
}

/// The exact value of a finite `f64`; `None` for NaN and infinities.
///
/// ```
/// use kardan_math::num::{rational_from_f64, rational_to_f64};
/// assert_eq!(rational_to_f64(&rational_from_f64(0.1).unwrap()), 0.1);
/// assert!(rational_from_f64(f64::NAN).is_none());
/// ```
pub fn rational_from_f64(value: f64) -> Option<Rational> {
    RBig::try_from(value).ok()
}

/// The decimal with the fewest digits that reads back as this double; `None` if it is not finite.
///
/// ```
/// use kardan_math::num::{Rational, shortest_decimal};
/// assert_eq!(shortest_decimal(0.1), Some(Rational::ONE / Rational::from(10)));
/// ```
pub fn shortest_decimal(value: f64) -> Option<Rational> {
    if !value.is_finite() {
        return None;
    }
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e')?;
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let number: i64 = format!("{whole}{part}").parse().ok()?;
    let exponent: i32 = exponent.parse::<i32>().ok()? - i32::try_from(part.len()).ok()?;
    let ten = (0..exponent.unsigned_abs()).fold(Rational::ONE, |power, _| power.times(&Rational::from(10)));
    let number = Rational::from(number);
    Some(if exponent < 0 { number.over(&ten) } else { number.times(&ten) })
}

/// The least common multiple of the denominators.
pub fn common_denominator<'a>(values: impl IntoIterator<Item = &'a Rational>) -> UBig {
    values.into_iter().filter(|x| !x.is_int()).fold(UBig::ONE, |all, x| {
        let shared = Gcd::gcd(&all, x.denominator());
        all / shared * x.denominator()
    })
}

/// `factor · value`, where the factor is a multiple of the denominator.
pub fn whole_multiple(value: &Rational, factor: &UBig) -> IBig {
    value.numerator() * IBig::from(factor / value.denominator())
}
