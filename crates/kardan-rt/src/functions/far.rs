//! Angles that are so large that the digits of 2/π must be chosen by their exponent.

use super::sums::{exact_product, ordered_sum};
use super::turns::{Reduced, sin_cos_of, tan_of};
use crate::format::Format;
use crate::real::Real;

/// 64 zeros, and the first 1216 binary digits of 2/π.
const TWO_OVER_PI: [u64; 20] = [
    0,
    0xa2f9_836e_4e44_1529,
    0xfc27_57d1_f534_ddc0,
    0xdb62_9599_3c43_9041,
    0xfe51_63ab_debb_c561,
    0xb724_6e3a_424d_d2e0,
    0x0649_2eea_09d1_921c,
    0xfe1d_eb1c_b129_a73e,
    0xe882_35f5_2ebb_4484,
    0xe99c_7026_b45f_7e41,
    0x3991_d639_8353_39f4,
    0x9c84_5f8b_bdf9_283b,
    0x1ff8_97ff_de05_980f,
    0xef2f_118b_5a0a_6d1f,
    0x6d36_7ecf_27cb_09b7,
    0x4f46_3f66_9e5f_ea2d,
    0x7527_bac7_ebe5_f17b,
    0x3d07_39f7_8a52_92ea,
    0x6bfb_5fb1_1f8d_5d08,
    0x5603_3046_fc7b_6bab,
];

/// 64 digits from one on.
fn digits(first: u64) -> u64 {
    let limb = |k: u64| usize::try_from(k).ok().and_then(|k| TWO_OVER_PI.get(k)).map_or(0, |limb| *limb);
    let (place, shift) = (first >> 6, first & 63);
    let next = limb(place.wrapping_add(1));
    (limb(place) << shift) | if shift == 0 { 0 } else { next >> 64_u64.wrapping_sub(shift) }
}

/// `a·b + carry` as high and low digits.
#[allow(clippy::as_conversions, clippy::cast_possible_truncation)] // the low half
fn product(a: u64, b: u64, carry: u64) -> (u64, u64) {
    let all = u128::from(a).wrapping_mul(u128::from(b)).wrapping_add(u128::from(carry));
    ((all >> 64) as u64, all as u64)
}

/// The angle of `m·2ᵉ` rad beyond the last multiple of π/2: digits of 2/π that make multiples of four quarters are left
/// out; of the others 192 are enough, since no number is closer to a multiple than 2⁻⁶².
#[allow(clippy::as_conversions, clippy::cast_possible_truncation)] // fractions are rounded to the nearest
fn reduced(x: f64) -> Reduced<f64> {
    if !x.is_finite() {
        return Reduced { quarters: 0.0, angle: (f64::NAN, 0.0) };
    }
    let bits = x.abs().to_bits();
    let mantissa = (bits & ((1 << 52) - 1)) | (1 << 52);
    // e − 2 digits before the ones that count, and 64 zeros; e is the exponent of the last digit, never below −32 here.
    let first = (bits >> 52).wrapping_sub(1075).wrapping_add(62);
    let (carry, low) = product(mantissa, digits(first.wrapping_add(128)), 0);
    let (carry, middle) = product(mantissa, digits(first.wrapping_add(64)), carry);
    let (_, high) = product(mantissa, digits(first), carry);
    let fraction = (u128::from((high << 2) | (middle >> 62)) << 64) | u128::from((middle << 2) | (low >> 62));
    // From half a quarter on, it is short of the next one.
    let fraction = fraction.cast_signed();
    let quarters = (high >> 62).wrapping_add(u64::from(fraction < 0));
    let quarter = 1.0 / 340_282_366_920_938_463_463_374_607_431_768_211_456.0;
    let (first, rest) = (fraction as f64, fraction.wrapping_sub(fraction as f64 as i128) as f64);
    let (first, rest) = (first * quarter, rest * quarter);
    let [_, _, (pi, pi_rest), ..] = f64::EIGHTHS;
    let (angle, lost) = exact_product(first, pi);
    let angle = ordered_sum(angle, lost + (first * pi_rest + rest * pi));
    let (quarters, angle) = if x < 0.0 { (quarters.wrapping_neg(), (-angle.0, -angle.1)) } else { (quarters, angle) };
    // Whole numbers of a sum with ROUND are in its last digits.
    Reduced { quarters: f64::from_bits(f64::ROUND.to_bits().wrapping_add(quarters)), angle }
}

/// Sine and cosine of an angle beyond [`Format::NEAR`].
#[inline(never)]
pub fn sin_cos<T: Real>(x: T) -> (T, T) {
    let (sine, cosine) = sin_cos_of(x.widened(), reduced(x.widened()));
    (T::nearest(sine), T::nearest(cosine))
}

/// The tangent of an angle beyond [`Format::NEAR`].
#[inline(never)]
pub fn tan<T: Real>(x: T) -> T {
    T::nearest(tan_of(x.widened(), reduced(x.widened())))
}
