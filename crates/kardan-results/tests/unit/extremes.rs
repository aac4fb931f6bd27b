//! Tests of `src/extremes.rs`.

use super::*;

#[test]
fn infinities_and_gaps_are_no_extremes() {
    let found = extremes(&[0.0, 1.0, 2.0, 3.0], &[f64::INFINITY, 2.0, 2.0, f64::NAN]);
    let at = Some(Extreme { value: 2.0, time: 1.0 });
    assert_eq!((found.min, found.max), (at, at));
    assert!(found.last.unwrap().is_nan());
    assert_eq!(extremes(&[], &[]), Extremes { min: None, max: None, last: None });
}
