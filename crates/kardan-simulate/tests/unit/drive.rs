//! Tests of `src/drive.rs`.

use super::*;

#[test]
fn spans_join_where_they_touch_and_the_last_one_ends_with_the_run() {
    let mut spans = Spans::default();
    for (time, active) in [(0.0, false), (1.0, true), (1.5, true), (2.0, false), (3.0, true), (3.0, false), (4.0, true)]
    {
        spans.now(time, active);
    }
    assert_eq!(spans.until(6.0), [Span { start: 1.0, end: 2.0 }, Span { start: 4.0, end: 6.0 }]);
    assert_eq!(spans.until(4.0), [Span { start: 1.0, end: 2.0 }]);
}
