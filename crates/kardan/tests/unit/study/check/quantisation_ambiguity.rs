//! Tests of `src/study/check/quantisation_ambiguity.rs`.

use super::*;

fn encoder(readings: &[f64]) -> Vec<EncoderReading> {
    let readings = readings.iter().enumerate().map(|(k, count)| (k as f64, *count)).collect();
    vec![EncoderReading { sensor: "encoder".into(), readings, until: None }]
}

fn undecided(own: &[f64], second: &[f64]) -> UndecidedReadings {
    UndecidedReadings::new(&encoder(own), &encoder(second))
}

#[test]
fn readings_far_from_boundaries_are_decided() {
    // Each is far enough, though the last one is as close as an earlier difference; at rest on a boundary both are equal.
    let found = undecided(&[0.0, 0.0, 1.5, 2.1], &[0.0, 0.0, 1.53, 2.1]);
    assert_eq!((found.first, found.flipped.len()), (None, 0));
    assert!(!undecided(&[1.5], &[1.5]).needs_third(1.0));
}

#[test]
fn readings_near_boundaries_are_undecided_and_flipped() {
    // An earlier error may occur again: the third reading is the same in both.
    let found = undecided(&[1.5, 1.501, 2.9995, 4.0008, 4.5], &[1.5, 1.502, 2.9995, 4.0008, 4.5]);
    assert_eq!(found.first, Some(UndecidedCount { time: 2.0, sensor: "encoder".into() }));
    let [below, above] = found.flipped[..] else { panic!("{:?}", found.flipped) };
    assert_eq!(below, FlippedReading { sensor: 0, reading: 2, boundary: 3.0, above: true });
    assert_eq!(above, FlippedReading { sensor: 0, reading: 3, boundary: 4.0, above: false });
    assert!(found.needs_third(1e3));
}

#[test]
fn a_second_run_that_parts_soon_needs_no_third() {
    let (own, second) = ([1.5, 1.9995, 2.9995, 3.5], [1.5, 1.9989, 3.0005, 3.2]);
    let found = undecided(&own, &second);
    assert_eq!(found.first.as_ref().map(|first| first.time), Some(1.0));
    // The reading at 2 s differs by itself; later ones belong to another trajectory.
    assert_eq!(found.flipped.iter().map(|flipped| flipped.reading).collect::<Vec<_>>(), [1]);
    assert!(found.needs_third(3.0) && !found.needs_third(30.0));
    let found = undecided(&own[2..], &second[2..]);
    assert_eq!((found.first.map(|first| first.time), found.flipped.len()), (Some(0.0), 0));
}

#[test]
fn readings_that_are_not_noted_are_undecided() {
    let mut own = encoder(&[1.5, 1.6]);
    own[0].until = Some(2.0);
    let found = UndecidedReadings::new(&own, &encoder(&[1.5, 1.6]));
    assert_eq!(found.first, Some(UndecidedCount { time: 2.0, sensor: "encoder".into() }));
    assert!(!found.needs_third(3.0));
}
