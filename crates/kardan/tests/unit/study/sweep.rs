//! Tests of `src/study/sweep/mod.rs`.

use super::answering;

/// A panic is the reason of a row.
#[test]
fn what_panics_is_a_reason() {
    assert_eq!(answering(|| Ok::<_, String>(3)), Ok(3));
    assert_eq!(answering(|| Err::<i32, _>("refused".into())), Err("refused".into()));
    let check = |found: Result<(), String>| assert!(found.unwrap_err().ends_with("please report it: index 3"));
    check(answering(|| panic!("index 3")));
    check(answering(|| panic!("index {}", 3)));
}
