//! Tests of `src/num/steffen.rs`.

use super::steffen;

/// Data on a parabola at three points with rising slopes has its slope in the middle.
#[test]
fn parabolas_retain_their_slope() {
    assert!((steffen(&[1.0, 2.0, 3.0], &[1.0, 4.0, 9.0])[1] - 4.0).abs() < 1e-15);
}
