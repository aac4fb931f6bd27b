//! Tests of `src/html.rs`.

use super::*;

/// The hint appears if a chart can be zoomed, and names charts that do not follow.
#[test]
fn the_hint_distinguishes_zoomable_from_static_charts() {
    let page = |still: &[bool]| {
        let chart = |still: &bool| Block::Chart(Chart { still: *still, ..Chart::default() });
        section(&Section { body: Body(still.iter().map(chart).collect()), ..Section::default() })
    };
    assert!(page(&[false]).contains("all charts follow"));
    assert!(!page(&[true]).contains("zoom"));
    let both = page(&[true, false]);
    assert!(both.contains("the others do not") && !both.contains("all charts follow"), "{both}");
}
