//! Tests of `src/curves.rs`.

use super::*;

fn curve_of<'a>(time: &'a [f64], values: &'a [f64]) -> Curve<'a> {
    let (physical, unit) = (Physical::Angle, "rad");
    let values = Cow::Borrowed(values);
    Curve {
        label: "a".into(),
        colour: Some(0),
        dash: &[],
        width: WIDTH,
        physical,
        unit,
        time: Cow::Borrowed(time),
        values,
    }
}

#[test]
fn curves_that_coincide_are_reported_whatever_their_samples() {
    let time: Vec<f64> = (0..1001).map(|k| f64::from(k) * 1e-3).collect();
    let step = |at: f64, size: f64| time.iter().map(|&t| if t < at { 0.0 } else { size }).collect::<Vec<f64>>();
    let (early, late, high) = (step(0.5, 1.0), step(0.502, 1.0), step(0.5, 1.01));
    let coarse = [0.0, 0.4999, 0.5, 1.0];
    let coarse_curve = curve_of(&coarse, &[0.0, 0.0, 1.0, 1.0]);
    assert!(coincide(&curve_of(&time, &early), &curve_of(&time, &late), 0.003));
    assert!(
        coincide(&curve_of(&time, &early), &coarse_curve, 0.003)
            && coincide(&coarse_curve, &curve_of(&time, &early), 0.003)
    );
    assert!(!coincide(&curve_of(&time, &early), &curve_of(&time, &high), 0.003));
    assert!(!coincide(&curve_of(&time, &step(0.6, 1.0)), &coarse_curve, 0.003));
    let half = time.len() / 2;
    assert!(!coincide(&curve_of(&time[..half], &early[..half]), &curve_of(&time, &early), 0.003));
}

#[test]
fn the_lower_of_coinciding_curves_are_wider_and_named() {
    let (time, values, other) = ([0.0, 1.0], [0.0, 1.0], [0.0, 0.5]);
    let named = |label: &str, values| Curve { label: label.into(), ..curve_of(&time, values) };
    let mut all = [named("a", &values), named("b", &other), named("c", &values)];
    assert!(mark_coincident(&mut all, 0.0));
    let labels: Vec<&str> = all.iter().map(|curve| curve.label.as_str()).collect();
    assert_eq!(labels, ["a", "b", "c (same as a)"]);
    assert!(all[0].width > all[2].width && all[1].width == all[2].width);
}

#[test]
fn file_names_are_safe_and_unique() {
    let plot = |id: &str| Plot { id: id.into(), ..Plot::default() };
    let plots = ["../../etc/passwd", "a", "a", "", "rack angle"].map(plot).to_vec();
    let study = Study { plots, ..Study::default() };
    assert_eq!(stems(&study), ["-..-etc-passwd", "a", "a-2", "plot", "rack-angle"]);
}
