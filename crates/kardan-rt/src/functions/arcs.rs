//! Angles of sines, cosines, tangents and points.

use super::sums::{exact_product, exact_sum, ordered_sum, polynomial, quotient};
use crate::format::Format;
use crate::number::Number;
use crate::real::Real;

/// The angle of the point (x, y) in rad, from the eighth of the plane in which it lies.
#[inline(always)]
pub fn atan2<N: Number>(y: N, x: N) -> N {
    let (zero, half, one) = (N::all(N::One::ZERO), N::all(N::One::HALF), N::all(N::One::ONE));
    let most = N::all(N::One::MOST);
    let (width, height) = (x.map(Real::abs), y.map(Real::abs));
    let (large, small) = (width.select(height, height, width), width.select(height, width, height));
    let small = most.select(large, most.select(small, one, zero), small);
    let large = most.select(large, one, large);
    let ((above, down), (below, up)) = N::One::RANGES;
    let factor = large.select(N::all(below), N::all(up), N::all(above).select(large, N::all(down), one));
    let (large, small) = (large * factor, small * factor);
    // Above tan(π/8) it is the angle beyond π/4.
    let limit = large * N::all(N::One::TAN_PI_8);
    let (sum, difference) = (exact_sum(large, small), exact_sum(small, -large));
    let over = (limit.select(small, difference.0, small), limit.select(small, difference.1, zero));
    let under = (limit.select(small, sum.0, large), limit.select(small, sum.1, zero));
    let least = N::all(N::One::LEAST);
    let (ratio, lost) = quotient(over, (large.select(least, one, under.0), under.1));
    let lost = small.select(N::all(N::One::NO_REST), zero, lost);
    let square = ratio * ratio;
    let rest = ratio * square * polynomial(N::One::ARC_TANGENT, square) + lost;
    // base ± (ratio + rest), the base a multiple of π/4.
    let steep = width.select(height, one, zero);
    let side = x.map(Format::sign);
    let direction = steep.select(half, side, -side);
    let base = |angles: [N::One; 5]| quadrant_angle(angles, [limit, small], steep, side);
    let (first, lost) = ordered_sum(base(N::One::EIGHTHS.map(|angle| angle.0)), direction * ratio);
    let base_rest = base(N::One::EIGHTHS.map(|angle| angle.1));
    let found = first + (lost + (direction * rest + base_rest));
    // NaN stays, infinity does not matter.
    let (width, height) = (half * most.select(width, most, width), half * most.select(height, most, height));
    (found + (width + height) * zero).zip(y, Format::with_sign)
}

/// One of the multiples of π/4 from 0 to π, by the location of a point: odd where `small` is above `limit`; `steep` is
/// 1 beyond π/4 from the x axis, else 0; `side` is the sign of x. A function, as closures are not always inlined.
#[inline(always)]
fn quadrant_angle<N: Number>(angles: [N::One; 5], [limit, small]: [N; 2], steep: N, side: N) -> N {
    let (zero, half) = (N::all(N::One::ZERO), N::all(N::One::HALF));
    let [none, eighth, quarter, three, half_turn] = angles.map(N::all);
    let even = steep.select(half, half_turn, quarter);
    let left = limit.select(small, three, even);
    let right = limit.select(small, eighth, steep.select(half, none, quarter));
    side.select(zero, left, right)
}

/// The angle within ±π/2 rad whose tangent this is.
#[inline(always)]
pub fn atan<N: Number>(x: N) -> N {
    atan2(x, N::all(N::One::ONE))
}

/// `asin s` of the smaller side s of a right-angled triangle as a sum, where `|x|` is s, or `1 − 2 s²` if it is above 1/2.
#[inline(always)]
pub fn half_angle<N: Number>(x: N) -> (N, N) {
    let (half, zero) = (N::all(N::One::HALF), N::all(N::One::ZERO));
    let size = x.map(Real::abs);
    let square = half.select(size, half * (N::all(N::One::ONE) - size), size * size);
    let root = square.map(Real::sqrt);
    let (product, lost) = exact_product(root, root);
    let rest = ((square - product) - lost) / (root + root);
    let rest = half.select(size, zero.select(root, rest, zero), zero);
    let side = half.select(size, root, size);
    (side, side * square * polynomial(N::One::ARC_SINE, square) + rest)
}

/// `base + factor·(side + rest)`, NaN where x is beyond ±1.
#[inline(always)]
pub fn arc<N: Number>(x: N, base: (N, N), factor: N, (side, rest): (N, N)) -> N {
    let (first, lost) = ordered_sum(base.0, factor * side);
    let found = first + (lost + (factor * rest + base.1));
    N::all(N::One::ONE).select(x.map(Real::abs), N::all(N::One::NAN), found)
}

/// The angle within ±π/2 rad whose sine this is, NaN beyond ±1.
#[inline(always)]
pub fn asin<N: Number>(x: N) -> N {
    let (half, one, size) = (N::all(N::One::HALF), N::all(N::One::ONE), x.map(Real::abs));
    let [none, _, quarter, ..] = N::One::EIGHTHS.map(|(first, rest)| (N::all(first), N::all(rest)));
    let base = (half.select(size, quarter.0, none.0), half.select(size, quarter.1, none.1));
    arc(x, base, half.select(size, -(one + one), one), half_angle(x)).zip(x, Format::with_sign)
}

/// The angle from 0 to π rad whose cosine this is, NaN beyond ±1.
#[inline(always)]
pub fn acos<N: Number>(x: N) -> N {
    let (half, zero, size) = (N::all(N::One::HALF), N::all(N::One::ZERO), x.map(Real::abs));
    let [none, _, quarter, _, half_turn] = N::One::EIGHTHS.map(|(first, rest)| (N::all(first), N::all(rest)));
    let side = x.map(Format::sign);
    let pick = |none: N, quarter: N, half_turn: N| half.select(size, side.select(zero, half_turn, none), quarter);
    let base = (pick(none.0, quarter.0, half_turn.0), pick(none.1, quarter.1, half_turn.1));
    arc(x, base, half.select(size, side + side, -side), half_angle(x))
}
