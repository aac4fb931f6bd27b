//! Functions by series of whole numbers: values times 2ᵖ, with p so large that the last digits do not matter.

use dashu_int::IBig;
use dashu_int::ops::SquareRoot;

/// A value as a whole number of `2⁻ᵖ`.
#[derive(Clone)]
pub struct Digits {
    pub value: IBig,
    pub places: usize,
}

/// Mantissa and exponent: `x = m·2ᵉ`.
fn parts(x: f64) -> (i64, i64) {
    let bits = x.abs().to_bits();
    let (mantissa, biased) = ((bits & ((1 << 52) - 1)) as i64, (bits >> 52) as i64);
    let (mantissa, exponent) = if biased == 0 { (mantissa, -1074) } else { (mantissa | (1 << 52), biased - 1075) };
    (if x < 0.0 { -mantissa } else { mantissa }, exponent)
}

/// `x·2ᵖ`, digits below left out.
fn shifted(value: IBig, by: i64) -> IBig {
    if by >= 0 { value << by as usize } else { value >> (-by) as usize }
}

fn fixed(x: f64, places: usize) -> IBig {
    let (mantissa, exponent) = parts(x);
    shifted(IBig::from(mantissa), exponent + places as i64)
}

/// Digits that leave 160 of them right in a number as small as x, or a result as small as its square.
fn places(x: f64) -> usize {
    let (_, exponent) = parts(x);
    400 + (-exponent).max(0) as usize
}

/// `Σ ± zᵏ⁺¹·…/(2k + 1)`: atan z (alternating) or atanh z.
fn arc_series(z: &IBig, places: usize, alternating: bool) -> IBig {
    let square: IBig = (z * z) >> places;
    let (mut power, mut sum, mut k) = (z.clone(), z.clone(), 1_i64);
    while power != IBig::ZERO && power != IBig::from(-1) {
        power = (power * &square) >> places;
        if alternating {
            power = -power;
        }
        k += 2;
        sum += &power / k;
    }
    sum
}

fn one(places: usize) -> IBig {
    IBig::from(1) << places
}

/// π by Machin's formula.
pub fn pi(places: usize) -> IBig {
    let extra = places + 32;
    let part = |n: i64| arc_series(&(one(extra) / n), extra, true);
    (16 * part(5) - 4 * part(239)) >> 32_usize
}

fn ln_2(places: usize) -> IBig {
    2 * arc_series(&(one(places) / 3), places, false)
}

/// Sine and cosine by their series, after the multiples of π/2.
pub fn sin_cos(x: f64) -> [Digits; 2] {
    let places = places(x);
    let extra = places + 1100;
    let quarter = pi(extra) >> 1_usize;
    let angle = fixed(x, extra);
    let quarters: IBig = ((&angle << 1_usize) + &quarter).div_euclid_floor(&(&quarter << 1_usize));
    let remainder: IBig = (angle - &quarters * quarter) >> 1100_usize;
    let (mut term, mut sums, mut k) = (one(places), [IBig::ZERO, one(places)], 0_i64);
    while term != IBig::ZERO && term != IBig::from(-1) {
        k += 1;
        term = ((term * &remainder) >> places) / k;
        match k % 4 {
            1 => sums[0] += &term,
            2 => sums[1] -= &term,
            3 => sums[0] -= &term,
            _ => sums[1] += &term,
        }
    }
    let [sine, cosine] = sums;
    let quadrant = i64::try_from(quarters.div_euclid_remainder(4)).expect("0 to 3");
    let (sine, cosine) = match quadrant {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    };
    [Digits { value: sine, places }, Digits { value: cosine, places }]
}

/// Quotients rounded down, which whole numbers leave to traits.
trait Down {
    fn div_euclid_floor(&self, by: &IBig) -> IBig;
    fn div_euclid_remainder(&self, by: i64) -> IBig;
}

impl Down for IBig {
    fn div_euclid_floor(&self, by: &IBig) -> IBig {
        use dashu_int::ops::DivEuclid;
        self.div_euclid(by)
    }

    fn div_euclid_remainder(&self, by: i64) -> IBig {
        let by = IBig::from(by);
        self - self.div_euclid_floor(&by) * by
    }
}

pub fn tan(x: f64) -> Digits {
    let [sine, cosine] = sin_cos(x);
    let places = sine.places;
    Digits { value: (sine.value << places) / cosine.value, places }
}

pub fn exp(x: f64) -> Digits {
    let places = 300 + (x.abs() * 1.5) as usize;
    let ln_2 = ln_2(places);
    let x = fixed(x, places);
    let twos = x.div_euclid_floor(&ln_2);
    let remainder = x - &twos * ln_2;
    let (mut term, mut sum, mut k) = (one(places), one(places), 0_i64);
    while term != IBig::ZERO {
        k += 1;
        term = ((term * &remainder) >> places) / k;
        sum += &term;
    }
    Digits { value: shifted(sum, i64::try_from(twos).expect("small")), places }
}

pub fn ln(x: f64) -> Digits {
    let places = 400;
    let (mantissa, exponent) = parts(x);
    let lift = mantissa.ilog2() as i64;
    let m = shifted(IBig::from(mantissa), places as i64 - lift);
    let s = ((&m - one(places)) << places) / (m + one(places));
    Digits { value: 2 * arc_series(&s, places, false) + (exponent + lift) * ln_2(places), places }
}

/// The arc tangent of a/b, both positive or zero, b not: less than one, near a half by a difference of angles.
fn arc_tangent(a: &IBig, b: &IBig, places: usize) -> IBig {
    if a > b {
        return (pi(places) >> 1_usize) - arc_tangent(b, a, places);
    }
    if &(a * IBig::from(4)) > b {
        let (above, below): (IBig, IBig) = (2 * a - b, 2 * b + a);
        let difference = arc_series(&((above << places) / below), places, true);
        return difference + arc_series(&(one(places) >> 1_usize), places, true);
    }
    arc_series(&((a << places) / b), places, true)
}

pub fn atan2(y: f64, x: f64) -> Digits {
    let larger = parts(x).1 - parts(y).1;
    let places = 1500 + larger.max(0) as usize;
    let angle = arc_tangent(&fixed(y.abs(), places), &fixed(x.abs(), places), places);
    let angle = if x.is_sign_negative() { pi(places) - angle } else { angle };
    Digits { value: if y.is_sign_negative() { -angle } else { angle }, places }
}

/// Sides of the triangle with hypotenuse 1.
fn sides(x: f64) -> (IBig, IBig, usize) {
    let places = 1200 + places(x);
    let side = fixed(x.abs(), places);
    let square = (one(2 * places) - &side * &side).into_parts().1;
    (side, IBig::from(square.sqrt()), places)
}

pub fn asin(x: f64) -> Digits {
    let (side, other, places) = sides(x);
    let angle = arc_tangent(&side, &other, places);
    Digits { value: if x < 0.0 { -angle } else { angle }, places }
}

pub fn acos(x: f64) -> Digits {
    let (side, other, places) = sides(x);
    let angle = arc_tangent(&other, &side, places);
    Digits { value: if x < 0.0 { pi(places) - angle } else { angle }, places }
}

impl Digits {
    /// How far a number is from it, in units of the number's last place.
    pub fn error_of(&self, found: f64) -> f64 {
        let (_, exponent) = parts(found);
        let difference = fixed(found, self.places) - &self.value;
        // 2⁻⁶⁰ of such a unit is enough.
        let scale = exponent + self.places as i64 - 60;
        let difference = i128::try_from(shifted(difference, -scale)).map_or(f64::INFINITY, |error| error as f64);
        difference.abs() / (60_f64).exp2()
    }
}
