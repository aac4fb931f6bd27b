//! Tests of `src/study/measure/measures.rs`.

use kardan_rt::functions::{atan2, cos, exp, sin};
use std::f64::consts::PI;

use super::*;

fn rows(end: f64, count: usize, of: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
    let times: Vec<f64> = (0..=count).map(|k| end * k as f64 / count as f64).collect();
    let values = times.iter().map(|t| of(*t)).collect();
    (times, values)
}

fn of(measure: Measure, rows: &(Vec<f64>, Vec<f64>), target: Option<f64>, band: Option<Band>) -> Measured {
    measured(measure, Window { times: &rows.0, values: &rows.1 }, target, band).unwrap()
}

/// Over whole periods the mean of the squares on the straight lines is exact to the order of the rows; the estimate contains the error.
#[test]
fn root_mean_squares_and_integrals_have_their_closed_forms() {
    let sine = rows(2.0, 1000, |t| 3.0 * sin(2.0 * PI * t));
    let rms = of(Measure::Rms, &sine, None, None);
    assert!((rms.value - 3.0 / 2.0_f64.sqrt()).abs() < 1e-12, "{rms:?}");
    let decay = rows(8.0, 800, |t| exp(-t));
    let exact = 1.0 - exp(-8.0);
    for (measure, sign) in [(Measure::Iae, -1.0), (Measure::Energy, 1.0)] {
        let values = (decay.0.clone(), decay.1.iter().map(|x| sign * x).collect());
        let found = of(measure, &values, None, None);
        let error = (found.value - exact).abs();
        // Of the trapezium rule: h²/12 of the difference of the slopes.
        assert!(error < 1.01 * 1e-4 / 12.0 && error <= found.grid && found.grid < 4.0 * error, "{found:?} {error}");
    }
    // |t - 1| from 0 to 3: 1/2 + 2, with the corner at a row and between two.
    for count in [3, 4] {
        let found = of(Measure::Iae, &rows(3.0, count, |t| 5.0 + t), Some(6.0), None);
        assert!((found.value - 2.5).abs() < 1e-12, "{found:?}");
    }
}

/// The step response of a second-order system: overshoot exp(-π z / √(1 - z²)), and the settling time from its closed form.
#[test]
fn overshoot_and_settling_time_are_those_of_the_step_response() {
    for z in [0.1, 0.3, 0.6] {
        let damped = (1.0_f64 - z * z).sqrt();
        let phase = atan2(damped, z);
        let step = |t: f64| 1.0 - exp(-z * t) * sin(damped * t + phase) / damped;
        let response = rows(60.0, 6000, |t| 2.0 - 3.0 * step(t));
        let expected = exp(-PI * z / damped);
        let found = of(Measure::Overshoot, &response, Some(-1.0), None);
        let error = (found.value - expected).abs();
        assert!(error < 2e-5 && error <= 1.1 * found.grid, "{z}: {found:?} {expected}");
        // The last time at which the distance is 5 %: found by bisection behind the last extreme that is outside.
        let distance = |t: f64| (step(t) - 1.0).abs();
        let last = (1..60).rev().map(|k| f64::from(k) * PI / damped).find(|t| distance(*t) > 0.05);
        let (mut low, mut high) = (last.unwrap_or(0.0), last.unwrap_or(0.0) + PI / damped);
        // Between an extreme and the next zero of the distance it falls.
        high = low.max(high - 0.5 * PI / damped + 0.0).min(high);
        let zero = (1..2000).map(|k| low + (high + PI / damped - low) * f64::from(k) / 2000.0);
        high = zero.into_iter().find(|t| distance(*t) < 0.05).unwrap_or(high);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if distance(middle) > 0.05 { low = middle } else { high = middle }
        }
        let found = of(Measure::SettlingTime, &response, Some(-1.0), Some(Band::Part(0.05)));
        assert!((found.value - low).abs() < 1e-4 && (found.grid - 0.01).abs() < 1e-12, "{z}: {found:?} {low}");
        let size = of(Measure::SettlingTime, &response, Some(-1.0), Some(Band::Size(0.15)));
        assert!((size.value - found.value).abs() < 1e-9);
    }
    assert!(cos(0.0) == 1.0);
}

#[test]
fn what_has_no_measure_says_why() {
    let window = |values: &'static [f64]| Window { times: &[0.0, 1.0, 2.0][..values.len()], values };
    let why = |measure, values| measured(measure, window(values), Some(1.0), Some(Band::Size(0.1))).unwrap_err();
    assert!(why(Measure::Overshoot, &[1.0, 2.0, 1.0]).contains("begins its window at its target"));
    assert!(why(Measure::SettlingTime, &[0.0, 1.0, 2.0]).contains("outside of its band at the end"));
    assert!(why(Measure::Max, &[0.0, f64::NAN]).contains("no number"));
    assert!(why(Measure::Rms, &[]).contains("no row"));
}
