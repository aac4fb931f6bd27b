//! Tests of `src/write/arrow_schema.rs`.

use super::*;

/// Strict enough for a test: no character outside the alphabet, padding only at the end.
fn decoded(text: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        _ => panic!("{c} is no digit"),
    };
    assert_eq!(text.len() % 4, 0);
    let digits = text.trim_end_matches('=').bytes().map(value);
    let bits: Vec<u8> = digits.flat_map(|digit| (0..6).rev().map(move |i| digit >> i & 1)).collect();
    bits.chunks_exact(8).map(|byte| byte.iter().fold(0, |sum, bit| sum << 1 | bit)).collect()
}

#[test]
fn base64_gives_the_examples_of_the_rfc() {
    for (plain, encoded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
        assert_eq!(base64(plain.as_bytes()), encoded);
    }
    assert_eq!(base64(&[0xfb, 0xff, 0xbf]), "+/+/");
    let all: Vec<u8> = (0..=255).collect();
    assert_eq!(decoded(&base64(&all)), all);
}

#[test]
fn the_message_is_framed_and_contains_names_units_and_descriptions() {
    let column = |name, unit| Column { name, unit, description: "Drehwinkel φ", values: &[] };
    let bytes = decoded(&arrow_schema(&[column("t", "s"), column("rk.phi", "rad")], &[("model", "gear")]));
    assert_eq!(bytes[..4], [0xff; 4]);
    let size = i32::from_le_bytes(bytes[4..8].try_into().unwrap());
    assert_eq!((size as usize, size % 8), (bytes.len() - 8, 0));
    for text in ["t", "s", "rk.phi", "rad", "unit", "description", "Drehwinkel φ", "model", "gear"] {
        // A flatbuffer string: its length, its bytes and a zero.
        let mut string = (text.len() as u32).to_le_bytes().to_vec();
        string.extend(text.as_bytes());
        string.push(0);
        assert!(bytes.windows(string.len()).any(|window| window == string), "`{text}` is not there");
    }
}
