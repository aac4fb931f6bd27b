//! Tests of `src/signal/table.rs`.

use super::*;
use kardan_expr::expr::polynomial;

/// Cubics go through the points with one slope on both sides, and are monotone where these are.
#[test]
fn cubics_are_smooth_and_monotone() {
    let (x, y) = ([0.0, 1.0, 1.5, 4.0, 5.0, 7.0], [0.0, 1.0, 1.1, 8.0, 8.0, 2.0]);
    let pieces = between(&x, &y, "cubic");
    let slope = |[_, b, c, d]: [f64; 4], h: f64| b + (2.0 * c + 3.0 * d * h) * h;
    for k in 0..pieces.len() {
        let (h, (start, piece)) = (x[k + 1] - x[k], pieces[k]);
        assert_eq!((start, piece[0]), (x[k], y[k]));
        assert!((polynomial(&piece, h) - y[k + 1]).abs() < 1e-14);
        if let Some((_, next)) = pieces.get(k + 1) {
            assert!((slope(piece, h) - next[1]).abs() < 1e-13);
        }
        let values: Vec<f64> = (0..=100).map(|j| polynomial(&piece, h * f64::from(j) / 100.0)).collect();
        let rise = (y[k + 1] - y[k]).signum() * f64::from(u8::from(y[k + 1] != y[k]));
        assert!(values.windows(2).all(|pair| rise * (pair[1] - pair[0]) >= -1e-14), "{k}: {values:?}");
    }
}
