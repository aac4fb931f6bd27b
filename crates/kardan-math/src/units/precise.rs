//! Functions of numbers to 256 binary digits, for values that are rounded once in the end.

use dashu_int::ops::{Abs, BitTest, SquareRoot};
use dashu_int::{IBig, UBig};
use dashu_ratio::RBig;
use kardan_rt::functions::{atan2, ln};

use super::Exact;
use crate::num::{exponent, rational_from_f64, rational_to_f64};

/// Binary digits of precision.
const DIGITS: isize = 256;
/// Of these, those that a calculation of some steps may lose.
const LOST: isize = 24;

/// The number with the leading binary digits.
pub(super) fn short(x: &RBig) -> RBig {
    if x.is_zero() {
        return RBig::ZERO;
    }
    let shift = DIGITS - exponent(x) as isize;
    if shift <= 0 {
        return x.clone();
    }
    let scaled = x.numerator() << shift as usize;
    RBig::from_parts(scaled / IBig::from(x.denominator().clone()), UBig::ONE << shift as usize)
}

/// Whether a number is at most the rounding error of another one.
pub(super) fn is_noise_of(x: &RBig, of: &RBig) -> bool {
    let bound = of.clone().abs() / RBig::from(UBig::ONE << (DIGITS - LOST) as usize);
    x.clone().abs() < bound
}

/// The square root of a number that is not negative; exact where it is a fraction.
pub(super) fn square_root(x: &RBig) -> (RBig, bool) {
    let (numerator, denominator) = (UBig::try_from(x.numerator().clone()).unwrap_or(UBig::ZERO), x.denominator());
    // √(n/d) = √(n d)/d
    let product = &numerator * denominator;
    let root = product.sqrt();
    if &root * &root == product {
        return (RBig::from_parts(root.into(), denominator.clone()), true);
    }
    let scaled = (product << (2 * DIGITS as usize)).sqrt();
    (short(&RBig::from_parts(scaled.into(), denominator.clone() << DIGITS as usize)), false)
}

/// `Σ xᵏ/k!` from a power on, in steps.
fn series(x: &RBig, first: RBig, start: i64, step: i64, alternates: bool) -> RBig {
    let mut power = short(x);
    if step == 2 {
        power = short(&(&power * &power));
    }
    if alternates {
        power = -power;
    }
    let (mut term, mut sum, mut k) = (first, RBig::ZERO, start);
    // Terms fall below the last digit.
    for _ in 0..80 {
        if term.is_zero() || term.numerator().bit_len() as isize + DIGITS < term.denominator().bit_len() as isize {
            break;
        }
        sum += &term;
        let divisor = if step == 2 { (k + 1) * (k + 2) } else { k + 1 };
        term = short(&(&term * &power / RBig::from(divisor)));
        k += step;
    }
    short(&sum)
}

/// eˣ, for sizes below a thousand.
pub(super) fn exponential(x: &RBig) -> RBig {
    const HALVINGS: usize = 16;
    let small = x / RBig::from(UBig::ONE << HALVINGS);
    let mut out = series(&small, RBig::ONE, 0, 1, false);
    for _ in 0..HALVINGS {
        out = short(&(&out * &out));
    }
    out
}

/// ln x, for numbers above zero.
pub(super) fn logarithm(x: &RBig) -> RBig {
    // x = m 2ᵏ with m near one.
    let k = exponent(x);
    let scale = RBig::from(UBig::ONE << k.unsigned_abs() as usize);
    let m = if k >= 0 { x / &scale } else { x * &scale };
    let one = |m: &RBig| {
        let mut y = rational_from_f64(ln(rational_to_f64(m))).unwrap_or(RBig::ZERO);
        for _ in 0..3 {
            let e = exponential(&y);
            y = short(&(&y + RBig::from(2) * (m - &e) / (m + &e)));
        }
        y
    };
    short(&(one(&m) + RBig::from(k) * one(&RBig::from(2))))
}

/// Sine and cosine.
pub(super) fn sine_cosine(x: &RBig) -> [RBig; 2] {
    let quarter = Exact::pi_digits() / RBig::from(2);
    let turns = (x / &quarter).round();
    let rest = short(&(x - RBig::from(turns.clone()) * &quarter));
    let sine = series(&rest, rest.clone(), 1, 2, true);
    let cosine = series(&rest, RBig::ONE, 0, 2, true);
    let turn = i64::try_from(turns % IBig::from(4)).unwrap_or(0).rem_euclid(4);
    match turn {
        0 => [sine, cosine],
        1 => [cosine, -sine],
        2 => [-sine, -cosine],
        _ => [-cosine, sine],
    }
}

/// The angle of a point, between −π and π; zero at the origin.
pub(super) fn angle(y: &RBig, x: &RBig) -> RBig {
    if y.is_zero() && x.is_zero() {
        return RBig::ZERO;
    }
    let (ay, ax) = (y.clone().abs(), x.clone().abs());
    // Of the smaller part: between 0 and 1.
    let swapped = ay > ax;
    let slope = short(&if swapped { &ax / &ay } else { &ay / &ax });
    let mut out = rational_from_f64(atan2(rational_to_f64(&slope), 1.0)).unwrap_or(RBig::ZERO);
    for _ in 0..3 {
        let [sine, cosine] = sine_cosine(&out);
        let rest = short(&((&slope * &cosine - &sine) / (&cosine + &slope * &sine)));
        out = short(&(&out + &rest - &rest * &rest * &rest / RBig::from(3)));
    }
    if swapped {
        out = Exact::pi_digits() / RBig::from(2) - out;
    }
    if *x < RBig::ZERO {
        out = Exact::pi_digits() - out;
    }
    short(&if *y < RBig::ZERO { -out } else { out })
}

#[cfg(test)]
#[path = "../../tests/unit/units/precise.rs"]
mod tests;
