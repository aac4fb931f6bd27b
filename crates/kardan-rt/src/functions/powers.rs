//! Exponential, logarithm and whole powers.

use super::sums::{exact_sum, ordered_sum, polynomial};
use crate::format::Format;
use crate::number::Number;
use crate::real::Real;

/// x to a whole power, by repeated squares; of the inverse where the power is negative.
#[inline]
pub fn powi<T: Real>(x: T, power: i32) -> T {
    let whole = |x: T| {
        let (mut rest, mut square, mut product) = (power.unsigned_abs(), x, T::ONE);
        while rest != 0 {
            if rest & 1 == 1 {
                product = product * square;
            }
            square = square * square;
            rest >>= 1;
        }
        product
    };
    if power >= 0 {
        return whole(x);
    }
    // One rounding less than powers of the inverse, which reach farther.
    let product = whole(x);
    if product.is_finite() { T::ONE / product } else { whole(T::ONE / x) }
}

/// eˣ
#[inline(always)]
pub fn exp<N: Number>(x: N) -> N {
    let (least, most) = N::One::EXPONENTS;
    let (least, most) = (N::all(least), N::all(most));
    let x = most.select(x, most, x.select(least, least, x));
    let rounded = x * N::all(N::One::ONE_OVER_LN_2) + N::all(N::One::ROUND);
    let n = rounded - N::all(N::One::ROUND);
    let (high, low) = N::One::LN_2;
    let (rest, lost) = exact_sum(x - n * N::all(high), -(n * N::all(low)));
    let (sum, lost_again) = ordered_sum(N::all(N::One::ONE), rest);
    let found = sum + (lost_again + (lost + rest * rest * polynomial(N::One::EXPONENTIAL, rest)));
    found.zip(rounded, Format::scaled)
}

/// The natural logarithm, NaN below zero; of the mantissa by `s = f/(2 + f)`: `ln(1 + f) = f − f²/2 + s (f²/2 + s² R(s²))`.
#[inline(always)]
pub fn ln<N: Number>(x: N) -> N {
    let (zero, one, normal) = (N::all(N::One::ZERO), N::all(N::One::ONE), N::all(N::One::NORMAL));
    let (factor, digits) = N::One::LIFT;
    let lifted = x.select(normal, x * N::all(factor), x);
    let exponent = lifted.map(Format::exponent) - x.select(normal, N::all(digits), zero);
    let f = lifted.map(Format::mantissa) - one;
    let s = f / (one + one + f);
    let square = s * s;
    let half = N::all(N::One::HALF) * f * f;
    let (high, low) = N::One::LN_2;
    let (sum, lost) = ordered_sum(exponent * N::all(high), f);
    let rest = half - (s * (half + square * polynomial(N::One::LOGARITHM, square)) + exponent * N::all(low));
    // x·0 preserves NaN.
    let found = sum + (lost - rest) + x * zero;
    let edge = x.select(zero, N::all(N::One::NAN), N::all(-N::One::INFINITY));
    let found = x.select(N::all(N::One::LEAST), edge, found);
    N::all(N::One::MOST).select(x, x, found)
}
