//! Elementary functions: the same bits on every target and in every lane.
//!
//! Each is made of sums, products, quotients, roots and selections, which every target rounds alike; nothing is contracted, nothing
//! branches, so a compiler may do several arguments side by side. Errors are below one unit in the last place (`tests/functions`
//! compares with digits found by whole numbers, the example `all_f32` tries every `f32`). Only sines, cosines and tangents of angles
//! beyond a million rad (six thousand for `f32`) leave that path, for one that is slower and as exact.
//!
//! Polynomials interpolate at Chebyshev's points; what is lost in the first sum is found by exact sums and products (Dekker, Knuth).

pub(crate) mod far;
mod format;

pub use format::Format;
pub use libm::{asinh, cbrt, exp2, hypot, log1p as ln_1p, log2, log10, pow as powf};

use crate::{Number, Real};

/// The sine of an angle in rad.
#[inline]
pub fn sin<N: Number>(x: N) -> N {
    x.sine_cosine().0
}

/// The cosine of an angle in rad.
#[inline]
pub fn cos<N: Number>(x: N) -> N {
    x.sine_cosine().1
}

/// Sine and cosine of an angle in rad.
#[inline]
pub fn sin_cos<N: Number>(x: N) -> (N, N) {
    x.sine_cosine()
}

/// The tangent of an angle in rad.
#[inline]
pub fn tan<N: Number>(x: N) -> N {
    x.tangent()
}

/// x to a whole power, by repeated squares; `1/xⁿ` where it is negative.
#[inline]
pub fn powi<T: Real>(x: T, power: i32) -> T {
    let (mut rest, mut square, mut product) = (power.unsigned_abs(), x, T::ONE);
    while rest != 0 {
        if rest & 1 == 1 {
            product = product * square;
        }
        square = square * square;
        rest >>= 1;
    }
    if power < 0 { T::ONE / product } else { product }
}

/// A constant in all lanes.
#[inline]
fn all<N: Number>(value: N::One) -> N {
    N::all(value)
}

/// A sum and what it lost, where the first is the larger or zero.
#[inline]
fn ordered_sum<N: Number>(a: N, b: N) -> (N, N) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// A sum and what it lost.
#[inline]
fn exact_sum<N: Number>(a: N, b: N) -> (N, N) {
    let sum = a + b;
    let own = sum - a;
    (sum, (a - (sum - own)) + (b - own))
}

/// Half of the digits, and the other half.
#[inline]
fn split<N: Number>(a: N) -> (N, N) {
    let large = a * all(N::One::SPLIT);
    let high = large - (large - a);
    (high, a - high)
}

/// A product and what it lost.
#[inline]
fn exact_product<N: Number>(a: N, b: N) -> (N, N) {
    let product = a * b;
    let ((a, a_low), (b, b_low)) = (split(a), split(b));
    (product, (((a * b - product) + a * b_low) + a_low * b) + a_low * b_low)
}

/// A quotient of sums `high + low`, and what it lost.
#[inline]
fn quotient<N: Number>(above: (N, N), below: (N, N)) -> (N, N) {
    let ratio = above.0 / below.0;
    let (product, lost) = exact_product(ratio, below.0);
    let rest = (((above.0 - product) - lost) + above.1) - ratio * below.1;
    (ratio, rest / below.0)
}

/// `c₀ + c₁ z + c₂ z² + …`, even and odd powers beside each other.
#[inline]
fn polynomial<N: Number>(coefficients: &[N::One], z: N) -> N {
    let square = z * z;
    let (mut even, mut odd) = (all::<N>(N::One::ZERO), all::<N>(N::One::ZERO));
    for pair in coefficients.chunks(2).rev() {
        if let [own, next] = pair {
            even = even * square + all(*own);
            odd = odd * square + all(*next);
        } else if let [own] = pair {
            even = even * square + all(*own);
        }
    }
    even + z * odd
}

/// An angle within ±π/4 rad (and a little more) as a sum; and how many quarters of a turn were subtracted, added to
/// [`Format::ROUND`].
#[derive(Clone, Copy)]
struct Reduced<N> {
    quarters: N,
    angle: (N, N),
}

/// Subtracts the multiple of π/2 in parts so short that products with it are exact.
#[inline]
fn reduced<N: Number>(x: N) -> Reduced<N> {
    let quarters = x * all(N::One::TWO_OVER_PI) + all(N::One::ROUND);
    let n = quarters - all(N::One::ROUND);
    let [first, second, third, rest] = N::One::HALF_PI.map(all::<N>);
    let (angle, lost) = exact_sum(x - n * first, -(n * second));
    let (angle, lost_again) = exact_sum(angle, -(n * third));
    Reduced { quarters, angle: exact_sum(angle, (lost + lost_again) - n * rest) }
}

/// What `sin(a + b) − a` is.
#[inline]
fn sine_rest<N: Number>((a, b): (N, N), square: N) -> N {
    a * square * polynomial(N::One::SINE, square) + b * (all::<N>(N::One::ONE) - all::<N>(N::One::HALF) * square)
}

/// `cos(a + b)` as a sum; the square of a may come with what it lost.
#[inline]
fn cosine<N: Number>((a, b): (N, N), (square, lost): (N, N)) -> (N, N) {
    let half = all::<N>(N::One::HALF);
    let own = half * square;
    let first = all::<N>(N::One::ONE) - own;
    let rest = square * square * polynomial(N::One::COSINE, square) - (a * b + half * lost);
    (first, ((all::<N>(N::One::ONE) - first) - own) + rest)
}

#[inline]
fn sin_cos_of<N: Number>(x: N, Reduced { quarters, angle }: Reduced<N>) -> (N, N) {
    let square = angle.0 * angle.0;
    let sine = angle.0 + sine_rest(angle, square);
    let (first, rest) = cosine(angle, (square, all(N::One::ZERO)));
    let cosine = first + rest;
    // 0 or 1, and signs ±1.
    let (odd, half) = (quarters.map(Format::is_odd), all(N::One::HALF));
    let turned = quarters.map(Format::turned);
    let (sine, cosine) = (odd.select(half, sine, cosine), odd.select(half, cosine, sine));
    let flipped = odd.select(half, turned, -turned);
    (x.map(Real::abs).select(all(N::One::NORMAL), x, turned * sine), flipped * cosine)
}

/// sin and cos from the sums of both; −cos/sin in odd quarters.
#[inline]
fn tan_of<N: Number>(x: N, Reduced { quarters, angle }: Reduced<N>) -> N {
    let square = exact_product(angle.0, angle.0);
    let sine = ordered_sum(angle.0, sine_rest(angle, square.0));
    let (first, rest) = cosine(angle, square);
    let cosine = ordered_sum(first, rest);
    let (odd, half) = (quarters.map(Format::is_odd), all(N::One::HALF));
    let above = (odd.select(half, sine.0, -cosine.0), odd.select(half, sine.1, -cosine.1));
    let below = (odd.select(half, cosine.0, sine.0), odd.select(half, cosine.1, sine.1));
    let (ratio, rest) = quotient(above, below);
    x.map(Real::abs).select(all(N::One::NORMAL), x, ratio + rest)
}

/// Sine and cosine where no angle is beyond [`Format::NEAR`].
#[inline]
pub(crate) fn sin_cos_near<N: Number>(x: N) -> (N, N) {
    sin_cos_of(x, reduced(x))
}

/// The tangent where no angle is beyond [`Format::NEAR`].
#[inline]
pub(crate) fn tan_near<N: Number>(x: N) -> N {
    tan_of(x, reduced(x))
}

/// eˣ
#[inline]
pub fn exp<N: Number>(x: N) -> N {
    let (least, most) = N::One::EXPONENTS;
    let (least, most) = (all::<N>(least), all::<N>(most));
    let x = most.select(x, most, x.select(least, least, x));
    let rounded = x * all(N::One::ONE_OVER_LN_2) + all(N::One::ROUND);
    let n = rounded - all(N::One::ROUND);
    let (high, low) = N::One::LN_2;
    let (rest, lost) = exact_sum(x - n * all(high), -(n * all(low)));
    let (sum, lost_again) = ordered_sum(all(N::One::ONE), rest);
    let found = sum + (lost_again + (lost + rest * rest * polynomial(N::One::EXPONENTIAL, rest)));
    found.zip(rounded, Format::scaled)
}

/// The natural logarithm, NaN below zero; of the mantissa by `s = f/(2 + f)`: `ln(1 + f) = f − f²/2 + s (f²/2 + s² R(s²))`.
#[inline]
pub fn ln<N: Number>(x: N) -> N {
    let (zero, one, normal) = (all::<N>(N::One::ZERO), all::<N>(N::One::ONE), all::<N>(N::One::NORMAL));
    let (factor, digits) = N::One::LIFT;
    let lifted = x.select(normal, x * all(factor), x);
    let exponent = lifted.map(Format::exponent) - x.select(normal, all(digits), zero);
    let f = lifted.map(Format::mantissa) - one;
    let s = f / (one + one + f);
    let square = s * s;
    let half = all::<N>(N::One::HALF) * f * f;
    let (high, low) = N::One::LN_2;
    let (sum, lost) = ordered_sum(exponent * all(high), f);
    let rest = half - (s * (half + square * polynomial(N::One::LOGARITHM, square)) + exponent * all(low));
    // x − x keeps NaN.
    let found = sum + (lost - rest) + (x - x);
    let edge = x.select(zero, all(N::One::NAN), all(-N::One::INFINITY));
    let found = x.select(all(N::One::LEAST), edge, found);
    all::<N>(N::One::MOST).select(x, x, found)
}

/// The angle of the point (x, y) in rad, from the eighth of the plane in which it lies.
#[inline]
pub fn atan2<N: Number>(y: N, x: N) -> N {
    let (zero, half, one) = (all::<N>(N::One::ZERO), all::<N>(N::One::HALF), all::<N>(N::One::ONE));
    let most = all::<N>(N::One::MOST);
    let (width, height) = (x.map(Real::abs), y.map(Real::abs));
    let (large, small) = (width.select(height, height, width), width.select(height, width, height));
    let small = most.select(large, most.select(small, one, zero), small);
    let large = most.select(large, one, large);
    let ((above, down), (below, up)) = N::One::RANGES;
    let factor = large.select(all(below), all(up), all::<N>(above).select(large, all(down), one));
    let (large, small) = (large * factor, small * factor);
    // Above tan(π/8) it is the angle beyond π/4.
    let limit = large * all(N::One::TAN_PI_8);
    let (sum, difference) = (exact_sum(large, small), exact_sum(small, -large));
    let over = (limit.select(small, difference.0, small), limit.select(small, difference.1, zero));
    let under = (limit.select(small, sum.0, large), limit.select(small, sum.1, zero));
    let least = all::<N>(N::One::LEAST);
    let (ratio, lost) = quotient(over, (large.select(least, one, under.0), under.1));
    let lost = small.select(all(N::One::NO_REST), zero, lost);
    let square = ratio * ratio;
    let rest = ratio * square * polynomial(N::One::ARC_TANGENT, square) + lost;
    // base ± (ratio + rest), the base a multiple of π/4.
    let steep = width.select(height, one, zero);
    let side = x.map(Format::sign);
    let base = |part: fn((N::One, N::One)) -> N::One| {
        let [none, eighth, quarter, three, all] = N::One::EIGHTHS.map(|angle| N::all(part(angle)));
        let pick = |turned: N, else_: N| limit.select(small, turned, else_);
        let left = steep.select(half, pick(three, all), pick(three, quarter));
        side.select(zero, left, steep.select(half, pick(eighth, none), pick(eighth, quarter)))
    };
    let direction = steep.select(half, side, -side);
    let (first, lost) = ordered_sum(base(|angle| angle.0), direction * ratio);
    let found = first + (lost + (direction * rest + base(|angle| angle.1)));
    // NaN stays, infinity does not matter.
    let (width, height) = (most.select(width, most, width), most.select(height, most, height));
    (found + (width - width) + (height - height)).zip(y, Format::with_sign)
}

/// The angle within ±π/2 rad whose tangent this is.
#[inline]
pub fn atan<N: Number>(x: N) -> N {
    atan2(x, all(N::One::ONE))
}

/// `asin s` of the smaller side s of a right-angled triangle as a sum, where `|x|` is s, or `1 − 2 s²` if it is above 1/2.
#[inline]
fn half_angle<N: Number>(x: N) -> (N, N) {
    let (half, zero) = (all::<N>(N::One::HALF), all::<N>(N::One::ZERO));
    let size = x.map(Real::abs);
    let square = half.select(size, half * (all::<N>(N::One::ONE) - size), size * size);
    let root = square.map(Real::sqrt);
    let (product, lost) = exact_product(root, root);
    let rest = ((square - product) - lost) / (root + root);
    let rest = half.select(size, zero.select(root, rest, zero), zero);
    let side = half.select(size, root, size);
    (side, side * square * polynomial(N::One::ARC_SINE, square) + rest)
}

/// `base + factor·(side + rest)`, NaN where x is beyond ±1.
#[inline]
fn arc<N: Number>(x: N, base: (N, N), factor: N, (side, rest): (N, N)) -> N {
    let (first, lost) = ordered_sum(base.0, factor * side);
    let found = first + (lost + (factor * rest + base.1));
    all::<N>(N::One::ONE).select(x.map(Real::abs), all(N::One::NAN), found)
}

/// The angle within ±π/2 rad whose sine this is, NaN beyond ±1.
#[inline]
pub fn asin<N: Number>(x: N) -> N {
    let (half, one, size) = (all::<N>(N::One::HALF), all::<N>(N::One::ONE), x.map(Real::abs));
    let [none, _, quarter, ..] = N::One::EIGHTHS.map(|(first, rest)| (all::<N>(first), all::<N>(rest)));
    let base = (half.select(size, quarter.0, none.0), half.select(size, quarter.1, none.1));
    arc(x, base, half.select(size, -(one + one), one), half_angle(x)).zip(x, Format::with_sign)
}

/// The angle from 0 to π rad whose cosine this is, NaN beyond ±1.
#[inline]
pub fn acos<N: Number>(x: N) -> N {
    let (half, zero, size) = (all::<N>(N::One::HALF), all::<N>(N::One::ZERO), x.map(Real::abs));
    let [none, _, quarter, _, turned] = N::One::EIGHTHS.map(|(first, rest)| (all::<N>(first), all::<N>(rest)));
    let side = x.map(Format::sign);
    let pick = |none: N, quarter: N, turned: N| half.select(size, side.select(zero, turned, none), quarter);
    let base = (pick(none.0, quarter.0, turned.0), pick(none.1, quarter.1, turned.1));
    arc(x, base, half.select(size, side + side, -side), half_angle(x))
}
