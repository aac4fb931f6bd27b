//! Tests of `src/study/sweep/reasons.rs`.

use super::*;

fn row(sample: u64, reason: &str) -> SweepRowOf<'_> {
    SweepRowOf { sample, variant: 0, reason, values: &[], measured: &[], passed: &[], figures: &[], difference: None }
}

/// Numbers that differ are left out; those that are the same, names and powers stay.
#[test]
fn numbers_that_differ_are_omitted() {
    let texts = [
        "`event.1.at` of `w2` is -0.25… kg m^2, 3 at most, at 1e-3 s.",
        "`event.1.at` of `w2` is 1/3 kg m^2, 3 at most, at 0.2 s.",
        "`event.2.at` of `w2` is 7 kg m^2, 3 at most, at 0.2 s.",
    ];
    let found = reasons(texts.into_iter().zip(10..).map(|(reason, sample)| row(sample, reason)), &["only".to_string()]);
    let summaries: Vec<(&str, &str, u64, u64)> =
        found.iter().map(|one| (one.reason.as_str(), one.example.as_str(), one.count, one.first)).collect();
    let first = "`event.1.at` of `w2` is … kg m^2, 3 at most, at … s.";
    assert_eq!(summaries, [(first, texts[0], 2, 10), (texts[2], texts[2], 1, 12)]);
}

/// Reasons behind the most that are told apart are counted together, and not with the last one.
#[test]
fn reasons_after_the_limit_are_counted_as_one() {
    let texts: Vec<String> = (1..=30).map(|k| "so ".repeat(k)).collect();
    let found = reasons(texts.iter().zip(0..).map(|(reason, sample)| row(sample, reason)), &["only".to_string()]);
    assert_eq!((found.len(), found[0].reason.as_str(), found[0].count, found[0].first), (21, OTHER_REASONS, 10, 20));
    assert!(found[1..].iter().all(|one| one.count == 1));
}
