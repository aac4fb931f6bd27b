//! Tests of `src/thin.rs`.

use kardan_rt::functions::{powi, sin};

use super::*;

#[test]
fn a_short_series_stays_whole() {
    assert_eq!(thin(&[0.0, 1.0, 2.0], &[5.0, f64::NAN, 7.0], 10), [0, 1, 2]);
    assert!(thin(&[], &[], 10).is_empty());
}

#[test]
fn extremes_ends_and_gaps_survive_and_the_limit_is_satisfied() {
    // Uneven grid, one spike up and one down of a single sample each, one hole.
    let time: Vec<f64> = (0..50_000).map(|i| powi(i as f64 / 50_000.0, 3)).collect();
    let mut values: Vec<f64> = time.iter().map(|t| sin(40.0 * t)).collect();
    values[31_415] = 9.0;
    values[27_182] = -8.0;
    values[12_345] = f64::NAN;
    let selected = thin(&time, &values, 2000);
    assert!(selected.len() <= 2001, "{} points", selected.len());
    assert!(selected.windows(2).all(|pair| pair[0] < pair[1]));
    for index in [0, 31_415, 27_182, 12_345, 49_999] {
        assert!(selected.contains(&index), "sample {index} was lost");
    }
}

#[test]
fn neither_the_sparse_nor_the_dense_half_starves() {
    // 1000 samples over 9 s, then 99 000 within 1 ms: thinning by count alone would leave 20 points for the 9 s.
    let time: Vec<f64> =
        (0..100_000).map(|i| if i < 1000 { 0.009 * i as f64 } else { 9.0 + 1e-8 * (i - 1000) as f64 }).collect();
    let values: Vec<f64> = (0..100_000).map(|i| sin(i as f64)).collect();
    let selected = thin(&time, &values, 2000);
    let sparse = selected.iter().filter(|&&index| index < 1000).count();
    assert!(sparse >= 900 && selected.len() - sparse >= 900, "{sparse} of {}", selected.len());
}
