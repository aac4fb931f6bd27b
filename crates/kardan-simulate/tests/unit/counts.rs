//! Tests of `src/counts.rs`.

use super::*;

#[test]
fn flipped_readings_come_out_on_the_requested_side() {
    let flipped = |reading, above| FlippedReading { sensor: 0, reading, boundary: 5.0, above };
    let all = [flipped(1, true), flipped(2, false), flipped(3, true), flipped(4, true)];
    let mut notes = Notes::new("encoder".into(), all.into());
    // Not flipped; below and flipped up; above and flipped down; above already; far from the boundary.
    let encoder_readings = [4.999, 4.999, 5.001, 5.001, 7.2];
    let counts: Vec<f64> =
        encoder_readings.iter().zip([0.0, 0.1, 0.2, 0.3, 0.4]).map(|(x, t)| notes.count(t, *x)).collect();
    assert_eq!(counts, [4.0, 5.0, 4.0, 5.0, 7.0]);
    let noted = notes.encoder_readings;
    assert_eq!(noted.readings, [(0.0, 4.999), (0.1, 4.999), (0.2, 5.001), (0.3, 5.001), (0.4, 7.2)]);
    assert_eq!((noted.sensor.as_str(), noted.until), ("encoder", None));
}
