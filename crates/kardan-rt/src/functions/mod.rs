//! Elementary functions: the same bits on every target and in every lane.
//!
//! Each function consists of sums, products, quotients, roots and selections, which every target rounds in the same
//! way; nothing is contracted and nothing branches, so a compiler can vectorise them. Errors are below one unit in the
//! last place (`tests/functions` compares with digits computed in integers, the example `all_f32` tests every `f32`).
//! Only sines, cosines and tangents of angles above a million rad (six thousand for `f32`) use another path, which is
//! slower and as accurate.
//!
//! Polynomials interpolate at Chebyshev points; exact sums and products (Dekker, Knuth) recover the rounding error of
//! the first sum.

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
