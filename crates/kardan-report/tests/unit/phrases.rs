//! Tests of `src/phrases.rs`.

use super::*;

#[test]
fn polynomials_read_as_written_by_hand() {
    let text = |coefficients: &[&str]| polynomial(&coefficients.iter().map(|&c| c.into()).collect::<Vec<_>>());
    assert_eq!(text(&["2", "-3/2", "0", "1"]), "s^3 - 3/2 s + 2");
    assert_eq!(text(&["-1", "-1"]), "-s - 1");
    assert_eq!(text(&["0"]), "0");
    assert_eq!(text(&[]), "0");
}

#[test]
fn pairs_are_joined_and_counted() {
    let values = [(-1.0, 0.0), (-3.0, 4.0), (-1.0, 0.0), (-3.0, -4.0), (0.0, -2.0)].map(Complex::from);
    assert_eq!(pairs(&values), ["−1 (twice)", "−3 ± 4 j", "0 ± 2 j"]);
    assert_eq!(list(&["a", "b", "c"], 2), "a, b and 1 more");
}

#[test]
fn what_was_not_searched_is_not_called_safe() {
    let rendered = |search: &DistanceToUncontrollability| distance_to_loss("observability", search).join(" ");
    let nothing = rendered(&DistanceToUncontrollability::default());
    assert!(nothing.contains("not searched for") && !nothing.contains("none"), "{nothing}");
    let searched = DistanceToUncontrollability {
        starts: 800,
        method: "too few cells".into(),
        ..DistanceToUncontrollability::default()
    };
    let searched = rendered(&searched);
    assert!(
        searched.contains("found none within ten tolerances") && searched.contains("from 800 points"),
        "{searched}"
    );
    assert!(!searched.contains("not searched"), "{searched}");
}

#[test]
fn lines_break_between_entries() {
    assert_eq!(unbroken("a 1 %, b 2 % and 3 more"), "a\u{a0}1\u{a0}%, b\u{a0}2\u{a0}% and 3 more");
}
