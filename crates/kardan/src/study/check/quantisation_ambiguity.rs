//! Readings so close to the boundary of two counts that the error of a run decides the count.

use crate::results::UndecidedCount;
use crate::simulate::{EncoderReading, FlippedReading};

/// A reading is undecided if its distance to a boundary is below this multiple of the largest difference of the two runs until then. The second run
/// errs more than the first.
const MARGIN: f64 = 1.0;
/// Fraction of a run within which the second one diverges after the first undecided reading, if it shows the effect of such readings.
const SOON: f64 = 0.1;

/// Results of the comparison of two runs about the readings of the first.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::study) struct UndecidedReadings {
    /// The first reading that is undecided, or that differs in the second run.
    pub first: Option<UndecidedCount>,
    /// The time of the first reading that differs in the second run, s; infinite if none did.
    diverged: f64,
    /// Undecided readings until then, each with its other value.
    pub flipped: Vec<FlippedReading>,
}

impl UndecidedReadings {
    /// Compares the readings of a run with those of a second one.
    pub(in crate::study) fn new(own: &[EncoderReading], second: &[EncoderReading]) -> Self {
        let pairs = || own.iter().zip(second);
        let diverged = pairs().filter_map(|(own, second)| parts(own, second)).min_by(|a, b| a.time.total_cmp(&b.time));
        let until = diverged.as_ref().map_or(f64::INFINITY, |first| first.time);
        let mut undecided = Self { first: diverged, diverged: until, flipped: Vec::new() };
        for (sensor, (own, second)) in pairs().enumerate() {
            let flipped = near_boundaries((sensor, own), second, until);
            let begin = flipped.first().map(|flipped| own.readings[flipped.reading].0);
            for time in begin.into_iter().chain(own.until.or(second.until)) {
                if undecided.first.as_ref().is_none_or(|first| time < first.time) {
                    undecided.first = Some(UndecidedCount { time, sensor: own.sensor.clone() });
                }
            }
            undecided.flipped.extend(flipped);
        }
        undecided
    }

    /// Whether a third run must show the effect of undecided readings, because in the second one they stayed equal for long. `length`: of the run, s.
    pub(in crate::study) fn needs_third(&self, length: f64) -> bool {
        let first = self.first.as_ref().map_or(f64::INFINITY, |first| first.time);
        !self.flipped.is_empty() && self.diverged - first > SOON * length
    }
}

/// The first reading with another count, or at another time.
fn parts(own: &EncoderReading, second: &EncoderReading) -> Option<UndecidedCount> {
    let mut pairs = own.readings.iter().zip(&second.readings);
    let (first, _) = pairs.find(|(a, b)| a.0 != b.0 || a.1.floor() != b.1.floor())?;
    Some(UndecidedCount { time: first.0, sensor: own.sensor.clone() })
}

/// Readings before a time that are closer to a boundary than the possible error of the runs. Signals that are bit-equal in both were constant.
fn near_boundaries(
    (sensor, own): (usize, &EncoderReading),
    second: &EncoderReading,
    until: f64,
) -> Vec<FlippedReading> {
    let (mut error, mut found) = (0.0f64, Vec::new());
    for (reading, ((time, value), (_, other))) in own.readings.iter().zip(&second.readings).enumerate() {
        if *time >= until {
            break;
        }
        error = error.max((value - other).abs());
        let boundary = value.round();
        if error > 0.0 && (value - boundary).abs() <= MARGIN * error {
            found.push(FlippedReading { sensor, reading, boundary, above: *value < boundary });
        }
    }
    found
}

#[cfg(test)]
mod tests {
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
}
