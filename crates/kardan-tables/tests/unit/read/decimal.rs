//! Tests of `src/read/decimal.rs`.

use proptest::prelude::*;

use super::*;

#[test]
fn numbers_end_where_they_end() {
    for (text, value, consumed) in [
        ("12.5;", 12.5, 4),
        ("-.5", -0.5, 3),
        ("5.", 5.0, 2),
        ("+1e3,", 1000.0, 4),
        ("1e", 1.0, 1),
        ("1D-2", 0.01, 4),
        ("00000000000000000000000000001.5", 1.5, 31),
        ("123456789012345678901234567890", 123_456_789_012_345_678_901_234_567_890.0, 30),
        ("1e999999999999999999999", f64::INFINITY, 23),
        ("0.0000000000000000000000000001", 1e-28, 30),
    ] {
        assert_eq!(leading(text.as_bytes(), b'.'), Some((value, consumed)), "{text}");
    }
    assert_eq!(leading(b"1,5;2", b','), Some((1.5, 3)));
    for text in ["", "-", ".", "x", "e5", "-e", "NaN"] {
        assert_eq!(leading(text.as_bytes(), b'.'), None, "{text}");
    }
    assert!(leading(b"-0.0", b'.').unwrap().0.is_sign_negative());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]
    #[test]
    fn every_decimal_is_rounded_as_by_the_standard_library(
        whole in 0u64.., digits in 0usize..22, power in -40i32..40, form in 0..4
    ) {
        let all = whole.to_string();
        let at = all.len().saturating_sub(digits);
        let text = match form {
            0 => format!("{}.{}", &all[..at], &all[at..]),
            1 => format!("0.{all}"),
            2 => format!("{}.{}e{power}", &all[..at], &all[at..]),
            _ => format!("{:?}", f64::from_bits(whole).abs()),
        };
        prop_assume!(text.starts_with(|c: char| c.is_ascii_digit() || c == '.') && text != ".");
        let expected: f64 = text.parse().unwrap();
        let (value, consumed) = leading(text.as_bytes(), b'.').unwrap();
        prop_assert_eq!(consumed, text.len());
        prop_assert_eq!(value.to_bits(), expected.to_bits(), "{}", text);
    }
}
