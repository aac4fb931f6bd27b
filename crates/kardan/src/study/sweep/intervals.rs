//! Intervals of probabilities.

use statrs::distribution::{Beta, ContinuousCDF};

/// Confidence of intervals of probabilities.
pub(super) const CONFIDENCE: f64 = 0.95;

/// The interval of a probability with `hits` of `all` observed.
pub(super) fn clopper_pearson(hits: u64, all: u64, confidence: f64) -> [f64; 2] {
    let (k, n, tail) = (hits as f64, all as f64, 0.5 * (1.0 - confidence));
    let point = |a: f64, b: f64, part: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(part));
    // At the ends there is a closed form.
    let low = match hits {
        0 => 0.0,
        _ if hits == all => kardan_rt::functions::exp(kardan_rt::functions::ln(tail) / n),
        _ => point(k, n - k + 1.0, tail),
    };
    let high = match hits {
        _ if hits == all => 1.0,
        0 => 1.0 - kardan_rt::functions::exp(kardan_rt::functions::ln(tail) / n),
        _ => point(k + 1.0, n - k, 1.0 - tail),
    };
    [low, high]
}
