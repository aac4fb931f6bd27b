//! Tests of `src/sampling.rs`.

use super::*;

/// Abramowitz and Stegun, table 26.5: P(|Z| < 1.959964) = 0.95, P(|Z| < 2.575829) = 0.99.
#[test]
fn quantiles_of_the_normal_distribution() {
    assert!((two_sided_quantile(0.95) - 1.959_963_984_540_054).abs() < 1e-12);
    assert!((two_sided_quantile(0.99) - 2.575_829_303_548_901).abs() < 1e-12);
    assert!((two_sided_quantile(0.5) - 0.674_489_750_196_082).abs() < 1e-12);
}

/// Newcombe 1998, table I: 81 of 263, and none of 20.
#[test]
fn intervals_of_wilson() {
    let Interval { lower: low, upper: high } = wilson(81, 263);
    assert!((low - 0.2553).abs() < 5e-5 && (high - 0.3662).abs() < 5e-5, "{low} {high}");
    let Interval { lower: low, upper: high } = wilson(0, 20);
    assert!(low == 0.0 && (high - 0.1611).abs() < 5e-5, "{low} {high}");
}
