//! Sine, cosine and tangent of angles that are not too large.

use super::sums::{exact_product, exact_sum, ordered_sum, polynomial, quotient};
use crate::format::Format;
use crate::number::Number;
use crate::real::Real;

/// An angle within ±π/4 rad (and a little more) as a sum; and how many quarters of a turn were subtracted, added to
/// [`Format::ROUND`].
#[derive(Clone, Copy)]
pub struct Reduced<N> {
    /// Quarters.
    pub quarters: N,
    /// The angle.
    pub angle: (N, N),
}

/// Subtracts the multiple of π/2 in parts so short that products with it are exact.
#[inline(always)]
pub fn reduced<N: Number>(x: N) -> Reduced<N> {
    let quarters = x * N::all(N::One::TWO_OVER_PI) + N::all(N::One::ROUND);
    let n = quarters - N::all(N::One::ROUND);
    let [first, second, third, rest] = N::One::HALF_PI.map(N::all);
    let (angle, lost) = exact_sum(x - n * first, -(n * second));
    let (angle, lost_again) = exact_sum(angle, -(n * third));
    Reduced { quarters, angle: exact_sum(angle, (lost + lost_again) - n * rest) }
}

/// `sin(a + b) − a`.
#[inline(always)]
pub fn sine_rest<N: Number>((a, b): (N, N), square: N) -> N {
    a * square * polynomial(N::One::SINE, square) + b * (N::all(N::One::ONE) - N::all(N::One::HALF) * square)
}

/// `cos(a + b)` as a sum; the square of a may come with its rounding error.
#[inline(always)]
pub fn cosine<N: Number>((a, b): (N, N), (square, lost): (N, N)) -> (N, N) {
    let half = N::all(N::One::HALF);
    let own = half * square;
    let first = N::all(N::One::ONE) - own;
    let rest = square * square * polynomial(N::One::COSINE, square) - (a * b + half * lost);
    (first, ((N::all(N::One::ONE) - first) - own) + rest)
}

#[inline(always)]
pub fn sin_cos_of<N: Number>(x: N, Reduced { quarters, angle }: Reduced<N>) -> (N, N) {
    let square = angle.0 * angle.0;
    let sine = angle.0 + sine_rest(angle, square);
    let (first, rest) = cosine(angle, (square, N::all(N::One::ZERO)));
    let cosine = first + rest;
    // 0 or 1, and signs ±1.
    let (odd, half) = (quarters.map(Format::is_odd), N::all(N::One::HALF));
    let half_turn_sign = quarters.map(Format::half_turn_sign);
    let (sine, cosine) = (odd.select(half, sine, cosine), odd.select(half, cosine, sine));
    let flipped = odd.select(half, half_turn_sign, -half_turn_sign);
    (x.map(Real::abs).select(N::all(N::One::NORMAL), x, half_turn_sign * sine), flipped * cosine)
}

/// `sin(a + b)` as a sum: of its series the second term, too, is exact.
#[inline(always)]
fn exact_sine<N: Number>((a, b): (N, N), (square, lost): (N, N)) -> (N, N) {
    let (Some((third, higher_terms)), one) = (N::One::SINE.split_first(), N::all(N::One::ONE)) else { return (a, b) };
    let third = N::all(*third);
    let cube = exact_product(a, square);
    let term = exact_product(cube.0, third);
    let higher_terms = cube.0 * (N::all(N::One::SINE_REST) + square * polynomial(higher_terms, square));
    let cube_rest = cube.1 + a * lost;
    let rest = term.1 + (cube_rest * third + higher_terms) + b * (one - N::all(N::One::HALF) * square);
    let (sum, lost) = ordered_sum(a, term.0);
    ordered_sum(sum, lost + rest)
}

/// sin and cos from the sums of both; −cos/sin in odd quarters.
#[inline(always)]
pub fn tan_of<N: Number>(x: N, Reduced { quarters, angle }: Reduced<N>) -> N {
    let square = exact_product(angle.0, angle.0);
    let sine = exact_sine(angle, square);
    let (first, rest) = cosine(angle, square);
    let cosine = ordered_sum(first, rest);
    let (odd, half) = (quarters.map(Format::is_odd), N::all(N::One::HALF));
    let above = (odd.select(half, sine.0, -cosine.0), odd.select(half, sine.1, -cosine.1));
    let below = (odd.select(half, cosine.0, sine.0), odd.select(half, cosine.1, sine.1));
    let (ratio, rest) = quotient(above, below);
    x.map(Real::abs).select(N::all(N::One::NORMAL), x, ratio + rest)
}

/// Sine and cosine where no angle is beyond [`Format::NEAR`].
#[inline(always)]
pub fn sin_cos<N: Number>(x: N) -> (N, N) {
    sin_cos_of(x, reduced(x))
}

/// The tangent where no angle is beyond [`Format::NEAR`].
#[inline(always)]
pub fn tan<N: Number>(x: N) -> N {
    tan_of(x, reduced(x))
}
