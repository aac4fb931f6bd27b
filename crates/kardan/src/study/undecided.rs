//! Readings that come so near to the boundary of two counts that the error of a run decides which count they are.

use crate::results::UndecidedCount;
use crate::simulate::{Met, Turned};

/// A reading is undecided where it is nearer to a boundary than so many times what two runs differed by at most until then. The second run
/// errs more than the first.
const MARGIN: f64 = 1.0;
/// Part of a run within which the second one takes another way, after the first undecided reading, if it tells what such readings do.
const SOON: f64 = 0.1;

/// What two runs tell of the readings of the first.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Doubts {
    /// The first reading that is undecided, or that came out otherwise in the second run.
    pub first: Option<UndecidedCount>,
    /// When the first one came out otherwise in the second run, s; infinite if none did.
    parted: f64,
    /// Readings until then that are undecided, each on its other side.
    pub turned: Vec<Turned>,
}

impl Doubts {
    /// Compares the readings of a run with those of a second one.
    pub(super) fn new(own: &[Met], second: &[Met]) -> Self {
        let pairs = || own.iter().zip(second);
        let parted = pairs().filter_map(|(own, second)| parts(own, second)).min_by(|a, b| a.time.total_cmp(&b.time));
        let until = parted.as_ref().map_or(f64::INFINITY, |first| first.time);
        let mut doubts = Self { first: parted, parted: until, turned: Vec::new() };
        for (sensor, (own, second)) in pairs().enumerate() {
            let turned = near_boundaries((sensor, own), second, until);
            let begin = turned.first().map(|turned| own.readings[turned.reading].0);
            for time in begin.into_iter().chain(own.until.or(second.until)) {
                if doubts.first.as_ref().is_none_or(|first| time < first.time) {
                    doubts.first = Some(UndecidedCount { time, sensor: own.sensor.clone() });
                }
            }
            doubts.turned.extend(turned);
        }
        doubts
    }

    /// Whether a third run is to tell what undecided readings do, as in the second one they came out the same for long. `length`: of the run, s.
    pub(super) fn ask_for_third(&self, length: f64) -> bool {
        let first = self.first.as_ref().map_or(f64::INFINITY, |first| first.time);
        !self.turned.is_empty() && self.parted - first > SOON * length
    }
}

/// The first reading with another count, or at another time.
fn parts(own: &Met, second: &Met) -> Option<UndecidedCount> {
    let mut pairs = own.readings.iter().zip(&second.readings);
    let (first, _) = pairs.find(|(a, b)| a.0 != b.0 || a.1.floor() != b.1.floor())?;
    Some(UndecidedCount { time: first.0, sensor: own.sensor.clone() })
}

/// Readings before a time that are nearer to a boundary than what the runs may err by. What is the same in both to the last bit has stood still.
fn near_boundaries((sensor, own): (usize, &Met), second: &Met, until: f64) -> Vec<Turned> {
    let (mut error, mut found) = (0.0f64, Vec::new());
    for (reading, ((time, met), (_, other))) in own.readings.iter().zip(&second.readings).enumerate() {
        if *time >= until {
            break;
        }
        error = error.max((met - other).abs());
        let boundary = met.round();
        if error > 0.0 && (met - boundary).abs() <= MARGIN * error {
            found.push(Turned { sensor, reading, boundary, above: *met < boundary });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn met(readings: &[f64]) -> Vec<Met> {
        let readings = readings.iter().enumerate().map(|(k, met)| (k as f64, *met)).collect();
        vec![Met { sensor: "encoder".into(), readings, until: None }]
    }

    fn doubts(own: &[f64], second: &[f64]) -> Doubts {
        Doubts::new(&met(own), &met(second))
    }

    #[test]
    fn readings_far_from_boundaries_are_decided() {
        // Far enough each, though the last one is as near as an earlier difference; at rest on a boundary both are the same.
        let found = doubts(&[0.0, 0.0, 1.5, 2.1], &[0.0, 0.0, 1.53, 2.1]);
        assert_eq!((found.first, found.turned.len()), (None, 0));
        assert!(!doubts(&[1.5], &[1.5]).ask_for_third(1.0));
    }

    #[test]
    fn readings_near_boundaries_are_undecided_and_turned() {
        // What was once an error may be one again: the third reading is the same in both.
        let found = doubts(&[1.5, 1.501, 2.9995, 4.0008, 4.5], &[1.5, 1.502, 2.9995, 4.0008, 4.5]);
        assert_eq!(found.first, Some(UndecidedCount { time: 2.0, sensor: "encoder".into() }));
        let [below, above] = found.turned[..] else { panic!("{:?}", found.turned) };
        assert_eq!(below, Turned { sensor: 0, reading: 2, boundary: 3.0, above: true });
        assert_eq!(above, Turned { sensor: 0, reading: 3, boundary: 4.0, above: false });
        assert!(found.ask_for_third(1e3));
    }

    #[test]
    fn a_second_run_that_parts_soon_tells_what_counts_do() {
        let (own, second) = ([1.5, 1.9995, 2.9995, 3.5], [1.5, 1.9989, 3.0005, 3.2]);
        let found = doubts(&own, &second);
        assert_eq!(found.first.as_ref().map(|first| first.time), Some(1.0));
        // The reading at 2 s came out otherwise by itself; what comes later is of another way.
        assert_eq!(found.turned.iter().map(|turned| turned.reading).collect::<Vec<_>>(), [1]);
        assert!(found.ask_for_third(3.0) && !found.ask_for_third(30.0));
        let found = doubts(&own[2..], &second[2..]);
        assert_eq!((found.first.map(|first| first.time), found.turned.len()), (Some(0.0), 0));
    }

    #[test]
    fn readings_that_are_not_noted_are_undecided() {
        let mut own = met(&[1.5, 1.6]);
        own[0].until = Some(2.0);
        let found = Doubts::new(&own, &met(&[1.5, 1.6]));
        assert_eq!(found.first, Some(UndecidedCount { time: 2.0, sensor: "encoder".into() }));
        assert!(!found.ask_for_third(3.0));
    }
}
