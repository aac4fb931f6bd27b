//! Sums and products with their rounding errors (Dekker, Knuth), and polynomials.

use crate::format::Format;
use crate::number::Number;
use crate::real::Real;

/// A sum and its rounding error, where the first is the larger or zero.
#[inline(always)]
pub fn ordered_sum<N: Number>(a: N, b: N) -> (N, N) {
    let sum = a + b;
    (sum, b - (sum - a))
}

/// A sum and its rounding error.
#[inline(always)]
pub fn exact_sum<N: Number>(a: N, b: N) -> (N, N) {
    let sum = a + b;
    let own = sum - a;
    (sum, (a - (sum - own)) + (b - own))
}

/// Half of the digits, and the other half.
#[inline(always)]
pub fn split<N: Number>(a: N) -> (N, N) {
    let large = a * N::all(N::One::SPLIT);
    let high = large - (large - a);
    (high, a - high)
}

/// A product and its rounding error.
#[inline(always)]
pub fn exact_product<N: Number>(a: N, b: N) -> (N, N) {
    let product = a * b;
    let ((a, a_low), (b, b_low)) = (split(a), split(b));
    (product, (((a * b - product) + a * b_low) + a_low * b) + a_low * b_low)
}

/// A quotient of sums `high + low`, and its rounding error.
#[inline(always)]
pub fn quotient<N: Number>(above: (N, N), below: (N, N)) -> (N, N) {
    let ratio = above.0 / below.0;
    let (product, lost) = exact_product(ratio, below.0);
    let rest = (((above.0 - product) - lost) + above.1) - ratio * below.1;
    (ratio, rest / below.0)
}

/// `c₀ + c₁ z + c₂ z² + …`, even and odd powers beside each other.
#[inline(always)]
pub fn polynomial<N: Number>(coefficients: &[N::One], z: N) -> N {
    let square = z * z;
    let (mut even, mut odd) = (N::all(N::One::ZERO), N::all(N::One::ZERO));
    for pair in coefficients.chunks(2).rev() {
        if let [own, next] = pair {
            even = even * square + N::all(*own);
            odd = odd * square + N::all(*next);
        } else if let [own] = pair {
            even = even * square + N::all(*own);
        }
    }
    even + z * odd
}
