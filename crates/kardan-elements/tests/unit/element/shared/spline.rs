//! Tests of `src/element/shared/spline.rs`.

use super::*;

/// A straight line is itself; a spline goes through its points, its derivatives are those of differences, and its curvature does
/// not jump, to rounding.
#[test]
fn splines_are_smooth_curves_through_their_points() {
    let points = [(-2.0, -1.5), (-0.5, -0.2), (0.3, 0.1), (1.0, 0.9), (2.5, 1.4)];
    let spline = Spline::new(&points).unwrap();
    for (x, y) in points {
        assert!((spline.value(x) - y).abs() < 1e-14);
        let [before, behind] = [-1e-9, 1e-9].map(|step| spline.derivatives(x + step).1);
        assert!((before - behind).abs() < 1e-7, "{before} {behind} at {x}");
    }
    for k in -40..50 {
        let (x, step) = (0.0731 * f64::from(k), 1e-5);
        let (slope, curvature) = spline.derivatives(x);
        let [low, high] = [x - step, x + step];
        assert!(((spline.value(high) - spline.value(low)) / (2.0 * step) - slope).abs() < 1e-8);
        let second = (spline.derivatives(high).0 - spline.derivatives(low).0) / (2.0 * step);
        assert!((second - curvature).abs() < 1e-4, "{second} {curvature} at {x}");
    }
    let line = Spline::new(&[(0.0, 1.0), (1.0, 3.0), (4.0, 9.0)]).unwrap();
    assert!((line.value(-3.0) + 5.0).abs() < 1e-14 && line.derivatives(2.0).1.abs() < 1e-14);
    assert_eq!(check_points("curve", &[(0.0, 0.0), (1.0, 1.0), (2.0, 0.0)]).len(), 1);
    assert_eq!(check_points("curve", &[(0.0, 0.0), (0.0, 1.0)]).len(), 1);
}
