//! Tests of `src/ticks.rs`.

use super::*;

#[test]
fn steps_are_round_and_labels_show_them_exactly() {
    let axis = |values: &[f64]| super::axis(values.iter().copied(), 0.0, 8);
    assert_eq!(axis(&[0.0, 9.0]).step, 1.0);
    let quarter = axis(&[0.0, 2.4]);
    assert_eq!((quarter.step, quarter.label(0.75)), (0.25, "0.75".into()));
    assert_eq!(quarter.label(1e-17), "0.00");
    let small = axis(&[-4e-5, 4e-5]);
    assert_eq!((small.label(-2e-5), small.label(0.0)), ("−2e−5".into(), "0".into()));
    assert_eq!(axis(&[0.0, 3.2e7]).label(2e7), "2.0e7");
}

#[test]
fn logarithmic_axes_have_whole_decades() {
    let axis = decades([-1.0, 0.0, 2e-12, 0.5, f64::NAN].into_iter());
    assert_eq!((axis.low, axis.high, axis.step), (-12.0, 0.0, 2.0));
    assert_eq!([-12.0, -2.0, 0.0, 3.0, 5.0, 0.5].map(decade), ["1e−12", "0.01", "1", "1000", "1e5", ""]);
    assert_eq!(decades([10.0].into_iter()), Axis::linear(1.0, 2.0, 1.0));
    assert_eq!(decades([0.0].into_iter()), Axis::linear(0.0, 1.0, 1.0));
}

#[test]
fn degenerate_data_gives_a_usable_axis() {
    for values in [&[][..], &[f64::NAN], &[0.0, 0.0], &[-3.0], &[1.0, 1.0 + 1e-15], &[f64::INFINITY, 2.0]] {
        let axis = axis(values.iter().copied(), 0.04, 6);
        assert!(axis.low < axis.high && axis.step > 0.0 && axis.step.is_finite(), "{values:?}: {axis:?}");
    }
}
