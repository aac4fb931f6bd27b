//! Tests of `src/present/sweep.rs`.

use super::*;

/// The complement to 100 % is not rounded to zero.
#[test]
fn parts_near_all_are_no_whole() {
    for (part, expected) in [
        (1.0, "100"),
        (0.999_963_11, "99.9963"),
        (0.999_999_63, "99.999963"),
        (0.9912, "99.12"),
        (0.99, "99"),
        (0.5, "50"),
        (0.123_456, "12.35"),
        (3.689e-5, "0.003689"),
        (3.689e-7, "3.689e−5"),
        (0.0, "0"),
    ] {
        assert_eq!(share(part, DIGITS), expected);
    }
    assert_eq!(share(0.999_63, 3), "99.963");
}
