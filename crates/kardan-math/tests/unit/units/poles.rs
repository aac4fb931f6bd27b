//! Tests of `src/units/poles.rs`.

use super::*;

#[test]
fn forms() {
    let q = Exact::from_ratio;
    for (text, expected) in [
        ("−50.1", vec![(q(-501, 10), q(0, 1))]),
        ("−1e−2 − 14.25j", vec![(q(-1, 100), q(-57, 4))]),
        ("-50.1", vec![(q(-501, 10), q(0, 1))]),
        ("-1e2", vec![(q(-100, 1), q(0, 1))]),
        ("-1e-2 + 1.5e+1j", vec![(q(-1, 100), q(15, 1))]),
        ("-14-14.25j", vec![(q(-14, 1), q(-57, 4))]),
        ("±3j", vec![(q(0, 1), q(3, 1)), (q(0, 1), q(-3, 1))]),
        ("-j", vec![(q(0, 1), q(-1, 1))]),
        ("-2 rad/s", vec![(q(-2, 1), q(0, 1))]),
        ("-1/2 ± 1/3i", vec![(q(-1, 2), q(1, 3)), (q(-1, 2), q(-1, 3))]),
    ] {
        assert_eq!(parse_poles(text).as_ref(), Ok(&expected), "{text}");
    }
    for text in ["", "j j", "fast", "-14 ± ", "1 + 2", "--3j", "nan", "inf", "-1 N m"] {
        assert!(parse_poles(text).is_err(), "{text}");
    }
}
