//! Tests of `src/element/driver.rs`.

use super::*;

#[test]
fn a_word_is_replaced_whole() {
    assert_eq!(
        with_word("a * lane(ahead) + ahead.x - aheads", "ahead", "d_ahead"),
        "a * lane(d_ahead) + ahead.x - aheads"
    );
}
