//! Tests of `src/mechanism/labels.rs`.

use super::*;

#[test]
fn long_names_show_begin_and_end() {
    let name = format!("shaft_{}_17", "x".repeat(80));
    let short = shorten(&name, 100.0);
    assert!(short.starts_with("shaft_") && short.ends_with("17") && short.contains('…'), "{short}");
    assert!(width(&short) <= 100.0);
    assert_eq!(shorten("rk", 100.0), "rk");
    assert_eq!(shorten("漢字漢字漢字漢字", 30.0).chars().count(), 2);
}
