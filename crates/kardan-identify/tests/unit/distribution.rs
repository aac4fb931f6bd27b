//! Tests of `src/distribution.rs`.

use kardan_rt::functions::{acos, cos};

use super::*;

/// Closed forms for one, two and four degrees of freedom; tables for others.
#[test]
fn students_quantiles() {
    for confidence in [0.01, 0.5, 0.9, 0.95, 0.99, 0.999_999] {
        let p = 0.5 * (1.0 + confidence);
        let alpha: f64 = 4.0 * p * (1.0 - p);
        let one = tan(std::f64::consts::FRAC_PI_2 * confidence);
        let two = confidence * (2.0 / alpha).sqrt();
        let cosine = cos(acos(alpha.sqrt()) / 3.0) / alpha.sqrt();
        let four = 2.0 * (cosine - 1.0).sqrt();
        for (freedom, expected) in [(1.0, one), (2.0, two), (4.0, four)] {
            let found = student_quantile(freedom, confidence);
            assert!((found / expected - 1.0).abs() < 1e-9, "{freedom} {confidence}: {found} for {expected}");
        }
    }
    for (freedom, expected) in [(5.0, 2.570_582), (30.0, 2.042_272), (1000.0, 1.962_339)] {
        assert!((student_quantile(freedom, 0.95) - expected).abs() < 1e-6);
    }
    // From the distribution to its expansion without a step.
    for confidence in [0.5, 0.95, 0.999] {
        let (below, above) = (student_quantile(MANY, confidence), student_quantile(MANY * (1.0 + 1e-12), confidence));
        assert!((below / above - 1.0).abs() < 1e-6, "{below} {above}");
    }
}

/// Every argument has an answer, and none takes long.
#[test]
fn nothing_hangs() {
    let normal = student_quantile(f64::INFINITY, 0.95);
    assert!((normal - 1.959_963_984_540_054).abs() < 1e-12);
    let odd = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE, 5e-324, 0.0, -1.0, 1.0, 1e17];
    for freedom in odd {
        for confidence in [0.95, f64::EPSILON, 1.0 - f64::EPSILON / 2.0, 0.0, 1.0, f64::NAN, f64::INFINITY] {
            let found = student_quantile(freedom, confidence);
            let sound = freedom > 0.0 && confidence > 0.0 && confidence < 1.0;
            assert_eq!(found.is_nan(), !sound, "{freedom} {confidence}: {found}");
        }
        assert!(chi_squared_median_ratio(freedom).is_finite() || !(freedom > 0.0), "{freedom}");
        for x in odd {
            for probability in [student_tails(freedom, x), chi_squared_tail(freedom, x), fisher_tail((freedom, x), 1.0)]
            {
                assert!(probability.is_none_or(|p| (0.0..=1.0).contains(&p)), "{freedom} {x}: {probability:?}");
            }
        }
    }
    assert!((chi_squared_median_ratio(2.0) - std::f64::consts::LN_2).abs() < 1e-12);
}
