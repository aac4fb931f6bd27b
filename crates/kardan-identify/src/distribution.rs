//! Quantiles and tails of the distributions that intervals and tests need: defined for every argument, in bounded time.

use kardan_rt::functions::{cbrt, powi, tan};
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, StudentsT};
use statrs::function::erf::{erfc, erfc_inv};

/// Degrees of freedom from which Student's quantile is taken from its expansion about the normal one. The error of the expansion
/// is below `(5z⁵ + 16z³ + 3z)/96ν²`, 1e-7 for a confidence of 99.9 %.
const MANY: f64 = 1e4;

/// More degrees of freedom than that change no digit of a reported probability.
const MOST: f64 = 1e9;

/// t with `P(|T| < t) = confidence` for Student's distribution; the normal one for infinitely many degrees of freedom. NaN, which
/// stands for "no interval", unless there are degrees of freedom and the confidence lies between 0 and 1.
pub fn student_quantile(freedom: f64, confidence: f64) -> f64 {
    if !(freedom > 0.0 && confidence > 0.0 && confidence < 1.0) {
        return f64::NAN;
    }
    if freedom > MANY {
        let z = std::f64::consts::SQRT_2 * erfc_inv(1.0 - confidence);
        return z + (z * z * z + z) / (4.0 * freedom);
    }
    // The sum of squares of a variance has at least the information of one of them.
    let freedom = freedom.max(1.0);
    let Ok(student) = StudentsT::new(0.0, 1.0, freedom) else { return f64::NAN };
    let tail = 0.5 * (1.0 - confidence);
    // None is wider than that with one degree of freedom, Cauchy's.
    let widest = tan(std::f64::consts::FRAC_PI_2 * confidence);
    upper_point(widest * (1.0 + 1e-12), |t| student.sf(t) > tail)
}

/// z with `P(|Z| > z) = probability` for a normal number, also for the smallest probabilities.
pub fn two_sided_normal(probability: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(probability)
}

/// z with `P(Z > z) = probability` for a normal number.
pub fn normal_quantile(probability: f64) -> f64 {
    std::f64::consts::SQRT_2 * erfc_inv(2.0 * probability)
}

/// The median of χ² with this many degrees of freedom divided by their number; fewer than one count as one.
pub(super) fn chi_squared_median_ratio(freedom: f64) -> f64 {
    match ChiSquared::new(freedom) {
        // The median lies below the mean.
        Ok(chi) if (1.0..MANY).contains(&freedom) => upper_point(freedom, |x| chi.cdf(x) < 0.5) / freedom,
        Ok(_) if freedom >= MANY => powi(1.0 - 2.0 / (9.0 * freedom), 3), // Wilson and Hilferty
        _ => 0.4549,
    }
}

/// The number between 0 and `high` up to which a condition is true, to the last bits.
fn upper_point(high: f64, below: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, high);
    for _ in 0..1100 {
        let middle = 0.5 * (low + high);
        if !(low < middle && middle < high) {
            break;
        }
        if below(middle) { low = middle } else { high = middle }
    }
    high
}

/// `P(|T| > ratio)` for Student's distribution; `None` without degrees of freedom, or where the ratio is no number.
pub(super) fn student_tails(freedom: f64, ratio: f64) -> Option<f64> {
    let student = StudentsT::new(0.0, 1.0, freedom.min(MOST)).ok().filter(|_| freedom >= 1.0)?;
    ratio.is_finite().then(|| (2.0 * student.sf(ratio.abs())).clamp(0.0, 1.0)).filter(|p| p.is_finite())
}

/// `P(χ² > sum)`; `None` as before.
pub(super) fn chi_squared_tail(freedom: f64, sum: f64) -> Option<f64> {
    if !(freedom >= 1.0 && freedom.is_finite() && sum.is_finite()) {
        return None;
    }
    if sum < f64::MIN_POSITIVE {
        return Some(1.0);
    }
    if freedom >= MANY {
        // Wilson and Hilferty: the cube root is normal.
        let variance = 2.0 / 9.0 / freedom;
        let z = (cbrt(sum / freedom) - (1.0 - variance)) / variance.sqrt();
        return Some(0.5 * erfc(z * std::f64::consts::FRAC_1_SQRT_2));
    }
    // Beyond that the probability is zero in floating point.
    let chi = ChiSquared::new(freedom).ok()?;
    Some(if sum > 100.0 * (freedom + 100.0) { 0.0 } else { (1.0 - chi.cdf(sum)).clamp(0.0, 1.0) })
}

/// `P(F > ratio)`; `None` as before.
pub(super) fn fisher_tail(degrees_of_freedom: (f64, f64), ratio: f64) -> Option<f64> {
    let sound = |freedom: f64| freedom >= 1.0 && freedom.is_finite();
    let (a, b) = (degrees_of_freedom.0.min(MOST), degrees_of_freedom.1.min(MOST));
    let fisher =
        FisherSnedecor::new(a, b).ok().filter(|_| sound(degrees_of_freedom.0) && sound(degrees_of_freedom.1))?;
    ratio.is_finite().then(|| (1.0 - fisher.cdf(ratio)).clamp(0.0, 1.0)).filter(|p| p.is_finite())
}

#[cfg(test)]
#[path = "../tests/unit/distribution.rs"]
mod tests;
