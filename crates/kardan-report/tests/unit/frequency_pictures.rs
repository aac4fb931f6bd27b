//! Tests of `src/frequency_pictures/mod.rs`.

use super::loop_plots::drawn;
use super::*;
use crate::drawing::Area;
use kardan::results::{ChannelMargin, LargestSingularValue, LoopGain, StepSignal};
use kardan_rt::functions::{powf, powi};

/// 1/(s (s + 1)²), whose phase is −180° at 1 rad/s with |L| = ½.
fn example() -> (LoopResponses, Vec<ChannelMargin>) {
    let frequencies: Vec<f64> = (0..=200).map(|k| powf(10.0, -2.0 + 0.02 * f64::from(k))).collect();
    let below = |w: &f64| (-2.0 * w * w, w * (1.0 - w * w));
    let square = |w: &f64| w * w * powi(1.0 + w * w, 2);
    let gain = LoopGain {
        name: "m & m".into(),
        real: frequencies.iter().map(|w| below(w).0 / square(w)).collect(),
        imaginary: frequencies.iter().map(|w| -below(w).1 / square(w)).collect(),
        unstable_poles: Some(0),
        ..LoopGain::default()
    };
    let margin = ChannelMargin {
        name: "m & m".into(),
        gain: [0.0, 2.0],
        gain_frequency: [None, Some(1.0)],
        phase: 21.386f64.to_radians(),
        phase_frequency: Some(0.6823),
        disk: 0.3,
        ..ChannelMargin::default()
    };
    let sensitivity = SingularValues {
        largest: Some(LargestSingularValue { value: 3.4, frequency: Some(0.77) }),
        values: frequencies.iter().map(|w| vec![1.0 + w, 0.1]).collect(),
        ..SingularValues::default()
    };
    let signal = StepSignal { name: "x".into(), unit: "rad".into(), motor: false, values: vec![0.0, 1.0, f64::NAN] };
    let step = StepResponse {
        reference: "<r>".into(),
        size: 1.0,
        unit: "rad".into(),
        time: vec![0.0, 0.1, 0.2],
        signals: vec![signal],
    };
    let found = LoopResponses {
        frequencies,
        nyquist: Some(100.0),
        loops: vec![gain],
        sensitivities: vec![sensitivity],
        steps: vec![step],
        ..LoopResponses::default()
    };
    (found, vec![margin])
}

#[test]
fn every_picture_is_drawn_with_its_marks_and_nothing_that_is_no_number() {
    let (found, margins) = example();
    let mut all = loops(&found, &margins, false);
    assert_eq!(all.len(), 3);
    // A gain and a phase margin in the Bode plot and in the Nichols chart.
    assert_eq!([0, 2].map(|k| all[k].drawing.matches("<circle").count()), [2, 2]);
    assert!(loops(&found, &margins, true).is_empty());
    all.extend(singular_values(&found));
    all.extend(steps(&found));
    assert_eq!(all.len(), 5);
    for picture in &all {
        assert!(picture.drawing.contains("<path fill=\"none\""), "{}", picture.title);
        for strange in ["NaN", "inf", "<r>", "m & m"] {
            assert!(!(picture.drawing.clone() + &picture.caption).contains(strange), "{}: {strange}", picture.title);
        }
    }
    assert!(references(&found).is_none());
}

#[test]
fn phases_have_no_jumps_and_margins_are_measured_from_half_a_turn() {
    let (found, margins) = example();
    let curves = drawn(&found, &margins, false);
    let phases = curves[0].phases();
    assert!((phases[0] + 91.1).abs() < 0.1 && (phases[200] + 268.9).abs() < 0.1, "{} {}", phases[0], phases[200]);
    assert!(phases.windows(2).all(|pair| (pair[1] - pair[0]).abs() < 10.0));
    let (at, phase, limit) = curves[0].phase_margin(&found.frequencies).expect("there is one");
    assert_eq!((at, limit), (0.6823, -180.0));
    assert!((phase + 158.614).abs() < 1e-6, "{phase}");
}

#[test]
fn a_contour_has_the_gain_that_it_names_and_curves_stay_inside_the_frame() {
    let area = Area { left: 0.0, top: 0.0, width: 10.0, height: 10.0 };
    let panel = Panel { area, across: Axis::linear(0.0, 1.0, 1.0), up: Axis::linear(0.0, 1.0, 1.0) };
    let cut = panel.cut((-10.0, 5.0), (20.0, 5.0)).expect("it crosses the frame");
    assert!((cut.0.0, cut.1.0) == (0.0, 10.0) && panel.cut((-5.0, 20.0), (20.0, 20.0)).is_none());
    assert_eq!(panel.curve([(0.5, 3.0), (0.5, 4.0)].into_iter(), ""), "");
}

#[test]
fn nothing_to_draw_gives_nothing() {
    let none = LoopResponses::default();
    assert!(loops(&none, &[], false).is_empty() && singular_values(&none).is_empty() && steps(&none).is_empty());
    let open = LoopGain { open: true, ..LoopGain::default() };
    assert!(loops(&LoopResponses { loops: vec![open], ..none }, &[], false).is_empty());
}
