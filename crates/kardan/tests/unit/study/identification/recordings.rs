//! Tests of `src/study/identification/recordings.rs`.

use super::fits;

#[test]
fn patterns_of_files() {
    for (pattern, name) in [("*.csv", "a.csv"), ("*", ""), ("a?c*", "abcd"), ("*MR.csv", "a3MR.csv"), ("", "")] {
        assert!(fits(pattern, name), "{pattern} {name}");
    }
    for (pattern, name) in [("*.csv", "a.csv2"), ("?", ""), ("a", "b"), ("*a", "ab")] {
        assert!(!fits(pattern, name), "{pattern} {name}");
    }
}
