//! Tests of `src/text.rs`.

use kardan_rt::functions::powi;

use super::*;

#[test]
fn figures_read_well() {
    let cases = [
        (0.0, "0"),
        (-0.0, "0"),
        (std::f64::consts::PI, "3.1416"),
        (-1.5, "−1.5"),
        (123_456.0, "123456"),
        (12_345_678.0, "1.2346e7"),
        (-2.5e-7, "−2.5e−7"),
        (0.000_123_456, "0.00012346"),
        (9.999_99, "10"),
        (f64::NAN, "–"),
        (f64::INFINITY, "–"),
    ];
    for (value, expected) in cases {
        assert_eq!(figure(value, 5), expected);
    }
    let long = Clock::until(9.0);
    assert_eq!((long.time(1.0), long.time(5.12345)), ("1 s".into(), "5.1235 s".into()));
    assert_eq!(Clock::until(2e-3).time(4.04e-4), "0.404 ms");
    assert_eq!(Clock::until(5e-5).time(1.25e-5), "12.5 µs");
    assert_eq!(Clock::until(0.0).time(f64::NAN), "–");
    assert_eq!(powers("s^12 + 3 s^2 + 20, e^-3"), "s¹² + 3 s² + 20, e^-3");
}

#[test]
fn json_is_short_and_safe() {
    assert_eq!(json_number(0.1 + 0.2), "0.3");
    assert_eq!(json_number(-1.25e-12), "-1.25e-12");
    assert_eq!(json_number(f64::NAN), "null");
    // Rust's output of the number that the nine digits parse to.
    let mut random = 1u64;
    for power in -40..40 {
        for part in [1.0, -1.0, 1.5, 0.123_456_789_012, 12.0, 120.0, 9.999_999_999_9, 0.0, 3.000_1] {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            for value in [part, (random >> 11) as f64, (random >> 50) as f64].map(|part| part * powi(10.0, power)) {
                let rounded: f64 = format!("{value:.8e}").parse().unwrap();
                let (plain, scientific) = (format!("{rounded}"), format!("{rounded:e}"));
                let expected = if plain.len() <= scientific.len() { plain } else { scientific };
                assert_eq!(json_number(value), expected, "{value:e}");
            }
        }
    }
    assert_eq!(json_numbers([]), "[]");
    assert_eq!(json_string("a\"</script>\n"), r#""a\"\u003c/script\u003e\u000a""#);
    assert_eq!(json_array(["1".into(), "2".into()]), "[1,2]");
}

#[test]
fn html_is_escaped() {
    assert_eq!((escape("a\u{202e}b"), json_string("a\u{202e}b")), ("a\\u{202e}b".into(), r#""a\\u{202e}b""#.into()));
    assert_eq!(escape("<b a=\"x\">&'\u{7}"), "&lt;b a=&quot;x&quot;&gt;&amp;&#39; ");
}
