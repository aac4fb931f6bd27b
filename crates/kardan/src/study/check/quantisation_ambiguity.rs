//! Readings so close to the boundary of two counts that the error of a run decides the count.

use kardan_results::UndecidedCount;
use kardan_simulate::{EncoderReading, FlippedReading};

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
#[path = "../../../tests/unit/study/check/quantisation_ambiguity.rs"]
mod tests;
