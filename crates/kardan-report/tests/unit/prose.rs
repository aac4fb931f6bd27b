//! Tests of `src/prose.rs`.

use super::*;

#[test]
fn long_fractions_become_decimals_and_short_ones_stay() {
    assert_eq!(rounded("k = 22000/26087"), "k = 22000/26087");
    assert_eq!(rounded("2428644332614449/2251799813685248 s"), "1.07853… s");
    assert_eq!(rounded("s^2 - 10000000000/30000000003 s + 1"), "s^2 - 0.333333… s + 1");
    // Integers beyond the range of floating point.
    let long = format!("{}/{}", "9".repeat(400), "3".repeat(399));
    assert_eq!(rounded(&long), "30…");
    for plain_start in
        ["a/b", "2026/11/23/04/25", "log_1234567/1234567", "1.234567/12345678", "12345678/", "/12345678901234"]
    {
        assert_eq!(rounded(plain_start), plain_start);
    }
}

#[test]
fn backticks_come_in_pairs() {
    use Piece::{Code, Plain};
    assert_eq!(pieces("under `drive` every run"), [Plain("under "), Code("drive"), Plain(" every run")]);
    assert_eq!(pieces("a ` alone"), [Plain("a ` alone")]);
    assert_eq!(pieces("`a`"), [Code("a")]);
    assert_eq!(pieces("``"), [Plain("``")]);
    assert!(pieces("").is_empty());
}
