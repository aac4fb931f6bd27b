//! Elementary functions: the same bits on every target and in every lane.
//!
//! Each is made of sums, products, quotients, roots and selections, which every target rounds alike; nothing is contracted, nothing
//! branches, so a compiler may do several arguments side by side. Errors are below one unit in the last place (`tests/functions`
//! compares with digits found by whole numbers, the example `all_f32` tries every `f32`). Only sines, cosines and tangents of angles
//! beyond a million rad (six thousand for `f32`) leave that path, for one that is slower and as exact.
//!
//! Polynomials interpolate at Chebyshev's points; what is lost in the first sum is found by exact sums and products (Dekker, Knuth).

mod arcs;
mod far;
mod powers;
mod sums;
mod turns;

pub use arcs::{acos, asin, atan, atan2};
pub use libm::{asinh, cbrt, exp2, hypot, log1p as ln_1p, log2, log10, pow as powf};
pub use powers::{exp, ln, powi};

use crate::number::Number;
use crate::real::Real;

/// Sine and cosine of an angle in rad.
#[inline(always)]
pub fn sin_cos<N: Number>(x: N) -> (N, N) {
    if x.any(is_far) { (x.map(|x| any_sin_cos(x).0), x.map(|x| any_sin_cos(x).1)) } else { turns::sin_cos(x) }
}

/// The sine of an angle in rad.
#[inline(always)]
pub fn sin<N: Number>(x: N) -> N {
    sin_cos(x).0
}

/// The cosine of an angle in rad.
#[inline(always)]
pub fn cos<N: Number>(x: N) -> N {
    sin_cos(x).1
}

/// The tangent of an angle in rad.
#[inline(always)]
pub fn tan<N: Number>(x: N) -> N {
    if x.any(is_far) { x.map(|x| if is_far(x) { far::tan(x) } else { turns::tan(x) }) } else { turns::tan(x) }
}

#[inline(always)]
fn is_far<T: Real>(x: T) -> bool {
    x.abs() > T::NEAR
}

#[cold]
fn any_sin_cos<T: Real>(x: T) -> (T, T) {
    if is_far(x) { far::sin_cos(x) } else { turns::sin_cos(x) }
}
