//! Tests of `src/study/sweep/tree.rs`.

use super::*;

/// Thresholds lie between their neighbours, with few digits; of the next number above they are that one.
#[test]
fn thresholds_are_round() {
    assert_eq!(halfway(94.93, 95.12), 95.0);
    assert_eq!(halfway(10.0, 20.0), 15.0);
    assert_eq!(halfway(-0.001, 0.1), 0.05);
    assert_eq!(halfway(1.0, 1.0 + f64::EPSILON), 1.0 + f64::EPSILON);
    assert_eq!(halfway(-2e-9, -1e-9), -1.5e-9);
}

/// Of two parameters that tell the same the first is taken; equal values stay together.
#[test]
fn ties_go_to_the_first() {
    let values: Vec<[f64; 2]> = (0..40).map(|k| [f64::from(k / 10), f64::from(k / 10)]).collect();
    let cases: Vec<Case<'_>> =
        values.iter().zip(0..).map(|(values, k)| Case { sample: k, values, failed: k >= 25 }).collect();
    let found = leaves(cases.iter().collect(), 2);
    assert!(found.iter().flat_map(|(bounds, _)| bounds).all(|bound| bound.parameter == 0), "{found:?}");
    let counts: Vec<_> = found.iter().map(|(_, count)| (count.all, count.failed)).collect();
    assert_eq!(counts, [(20, 0), (10, 5), (10, 10)]);
}
