//! Lengths whose squares overflow floating point, and roundings to one side.

use dashu_int::UBig;
use dashu_int::ops::BitTest;
use kardan_rt::functions::{log2, powi};

use super::{Rational, Scalar, rational_from_f64, rational_to_f64};

/// The square root of the sum of squares: no square of it overflows or vanishes.
///
/// ```
/// use kardan_math::num::length;
/// assert!((length(&[3e-200, 4e-200]) / 5e-200 - 1.0).abs() < 1e-15);
/// assert!((length(&[3e200, 4e200]) / 5e200 - 1.0).abs() < 1e-15);
/// assert_eq!((length(&[]), length(&[f64::INFINITY, 1.0])), (0.0, f64::INFINITY));
/// ```
pub fn length(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0f64, |largest, x| largest.max(x.abs()));
    if largest == 0.0 || !values.iter().all(|x| x.is_finite()) {
        return values.iter().fold(largest, |sum, x| sum + x.abs());
    }
    // A power of two near it, which may itself not leave the numbers.
    let power = (log2(largest).floor() as i32).clamp(-1000, 1000);
    let (down, up) = (powi(2.0, -power), powi(2.0, power));
    values.iter().map(|x| powi(x * down, 2)).sum::<f64>().sqrt() * up
}

/// `2^power`, exact.
pub fn power_of_two(power: i64) -> Rational {
    let whole = Rational::from(UBig::ONE << power.unsigned_abs() as usize);
    if power < 0 { Rational::ONE / whole } else { whole }
}

/// log₂ of the size of a number other than zero, to about one.
pub fn exponent(x: &Rational) -> i64 {
    x.numerator().bit_len() as i64 - x.denominator().bit_len() as i64
}

/// The least number of floating point not below an exact one; infinite if there is none.
///
/// ```
/// use kardan_math::num::{Rational, above, below};
/// let third = Rational::from_parts(1.into(), 3u8.into());
/// assert!(below(&third) < above(&third) && below(&third).next_up() == above(&third));
/// ```
pub fn above(x: &Rational) -> f64 {
    let near = rational_to_f64(x);
    match rational_from_f64(near) {
        Some(exact) if exact < *x => near.next_up(),
        Some(_) => near,
        None if near > 0.0 => near,
        None => f64::MIN,
    }
}

/// The largest number of floating point not above an exact one; minus infinity if there is none.
pub fn below(x: &Rational) -> f64 {
    -above(&-x.clone())
}

/// The square root of a number that is not negative, to a relative error of 4 · 2⁻⁵², not below it: not zero where the number is not, however
/// small it is.
///
/// ```
/// use kardan_math::num::{power_of_two, rational_to_f64, root_above};
/// assert_eq!(rational_to_f64(&(root_above(&power_of_two(-4000)) / power_of_two(-2000))).round(), 1.0);
/// ```
pub fn root_above(square: &Rational) -> Rational {
    if Scalar::is_zero(square) {
        return Rational::ZERO;
    }
    let half = exponent(square).div_euclid(2);
    let root = rational_to_f64(&(square * power_of_two(-2 * half))).sqrt() * (1.0 + 4.0 * f64::EPSILON);
    rational_from_f64(root).unwrap_or(Rational::ONE) * power_of_two(half)
}

#[cfg(test)]
#[path = "../../tests/unit/num/size.rs"]
mod tests;
