//! Tests of `src/study/measure/measures_over_input.rs`.

use super::*;

fn rows(end: f64, count: usize, of: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let times: Vec<f64> = (0..=count).map(|k| end * k as f64 / count as f64).collect();
    let values = times.iter().map(|t| of(*t)).collect();
    (times, values)
}

fn of(measure: Measure, x: &(Vec<f64>, Vec<f64>), y: &[f64], frequency: f64) -> f64 {
    measured_over(measure, Window { times: &x.0, values: &x.1 }, y, Some(frequency)).unwrap().value
}

/// The steady-state response of a second-order system to a sine: 1/(1 + 2 z i r - r^2), with an offset that the fit removes.
#[test]
fn gain_and_lag_are_those_of_a_second_order_system() {
    let f = 0.7;
    for (natural, z) in [(1.3, 0.2), (0.5, 0.7), (0.7, 0.05)] {
        let r: f64 = f / natural;
        let (re, im) = (1.0 - r * r, 2.0 * z * r);
        let (gain, angle) = (1.0 / (re * re + im * im).sqrt(), atan2(im, re));
        let y = rows(7.9, 4000, |t| 2.0 * sin(2.0 * PI * f * t) - 0.3);
        let x = rows(7.9, 4000, |t| 5.0 + 2.0 * gain * sin(2.0 * PI * f * t - angle));
        let close = |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
        close(of(Measure::Gain, &x, &y.1, f), gain);
        close(of(Measure::PhaseLag, &x, &y.1, f), angle);
        close(of(Measure::Lag, &x, &y.1, f), angle / (2.0 * PI * f));
    }
}

/// Coulomb friction c parallel to a spring s: the force is s y + c sign(y'), so the branches are 2 c apart and the slope is s.
#[test]
fn the_hysteresis_of_friction_beside_a_spring() {
    let (s, c) = (40.0, 1.5);
    let turn = 2.0 * PI * 0.5;
    let y = rows(8.0, 7999, |t| 0.3 * sin(turn * t));
    let x = rows(8.0, 7999, |t| s * 0.3 * sin(turn * t) + if cos(turn * t) > 0.0 { c } else { -c });
    assert!((of(Measure::Hysteresis, &x, &y.1, 0.0) - 2.0 * c).abs() < 1e-12);
    assert!((of(Measure::Gradient, &x, &y.1, 0.0) - s).abs() < 1e-9);
    let line = rows(8.0, 7999, |t| 3.0 - s * 0.3 * sin(turn * t));
    assert!((of(Measure::Slope, &line, &y.1, 0.0) + s).abs() < 1e-9);
}

/// Zero rows are no crossings until the sign changes.
#[test]
fn a_start_at_zero_is_no_crossing() {
    let y = [0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 2.0];
    let rising = zero_crossings(&y, true);
    assert_eq!(rising.len(), 1);
    assert_eq!((rising[0].before, rising[0].behind), (5, 6));
    let falling = zero_crossings(&y, false);
    assert_eq!((falling.len(), falling[0].before, falling[0].behind), (1, 2, 5));
}

#[test]
fn what_has_no_measure_says_why() {
    let x = rows(1.0, 100, |t| t);
    let why = |measure, y: &[f64], frequency| {
        measured_over(measure, Window { times: &x.0, values: &x.1 }, y, Some(frequency)).unwrap_err()
    };
    let level = vec![1.0; 101];
    assert!(why(Measure::Gradient, &level, 0.0).contains("never passes zero"));
    assert!(why(Measure::Slope, &level, 0.0).contains("stays the same"));
    assert!(why(Measure::Hysteresis, &level, 0.0).contains("both ways"));
    assert!(why(Measure::Gain, &level, 0.5).contains("shorter than a period"));
    assert!(why(Measure::Lag, &level, 50.0).contains("eight rows"));
    assert!(why(Measure::Gain, &[f64::NAN; 101], 1.0).contains("no number"));
}
