//! The error of a run, estimated by a second run.

use crate::results::{Accuracy, Effort, Event, IntegrationMethod, Outcome, Run, Series, Signal, SignalError};
use crate::simulate::{Method, RunResult, Tolerance};

/// How much looser the second run is.
const LOOSER: f64 = 10.0;
/// Part of the difference that is taken for the error of the run. Errors that follow the tolerance exactly would be a ninth of it; a
/// third is safe where they follow it less well, and where both runs are near the rounding of numbers.
const PART: f64 = 1.0 / 3.0;
/// The same where rounding decides about the error of a run: no tolerance makes it smaller, and both errors are alike.
const PART_OF_ROUNDING: f64 = 3.0;

/// The tolerance of the second run. It goes step by step: exponentials have no tolerance that could be looser.
pub(super) fn looser(tolerance: Tolerance) -> Tolerance {
    let method = match tolerance.method {
        Method::Automatic => Method::Stepping,
        method => method,
    };
    Tolerance { relative: LOOSER * tolerance.relative, absolute: LOOSER * tolerance.absolute, method, ..tolerance }
}

/// What the difference to a second run tells of a run; none where one of them ended early. Readings of sensors are left out: they are
/// copies of other signals, and where they are rounded to counts they jump by one.
pub(super) fn estimate(run: &Run, second: &RunResult, tolerance: Tolerance, readings: &[String]) -> Option<Accuracy> {
    if run.outcome != Outcome::Completed || second.outcome != Outcome::Completed {
        return None;
    }
    let gaps = gaps(&run.events, &second.events);
    let rows = common_rows(&run.series, &second.series, gaps.as_deref().unwrap_or_default());
    let mut errors: Vec<SignalError> = Vec::new();
    // Steps by series do not look at it.
    let rounded = |effort: &Effort| effort.rounding > 1.0 && effort.method != IntegrationMethod::Taylor;
    let rounded = rounded(&run.effort) || rounded(&second.effort);
    let part = if rounded { PART_OF_ROUNDING } else { PART };
    let pairs = run.series.signals.iter().zip(&second.series.signals);
    for (signal, other) in pairs.filter(|(signal, _)| !readings.contains(&signal.name)) {
        let error = part * largest_difference(signal, other, &rows);
        let unit = signal.physical;
        let own = || SignalError { signal: signal.name.clone(), unit, error };
        match errors.iter_mut().find(|known| known.unit == unit) {
            Some(known) if known.error >= error => {}
            Some(known) => *known = own(),
            None => errors.push(own()),
        }
    }
    let looser = LOOSER * tolerance.relative;
    Some(Accuracy { tolerance: tolerance.relative, looser, same_events: gaps.is_some(), rounded, errors })
}

/// The times between each event and its like, if both runs have the same ones.
fn gaps(own: &[Event], other: &[Event]) -> Option<Vec<(f64, f64)>> {
    let same = own.len() == other.len() && own.iter().zip(other).all(|(a, b)| a.what == b.what);
    same.then(|| own.iter().zip(other).map(|(a, b)| (a.time.min(b.time), a.time.max(b.time))).collect())
}

/// Rows of both at the same times, outside of the gaps.
fn common_rows(own: &Series, other: &Series, gaps: &[(f64, f64)]) -> Vec<(usize, usize)> {
    let mut rows = Vec::new();
    let (mut k, mut gap) = (0, 0);
    for (row, &time) in own.time.iter().enumerate() {
        while k < other.time.len() && other.time[k] < time {
            k += 1;
        }
        while gap < gaps.len() && gaps[gap].1 < time {
            gap += 1;
        }
        // Values at an event are those after it, in one run perhaps already.
        let mut begun = gaps[gap..].iter().take_while(|(from, _)| *from <= time);
        let within = begun.any(|(from, until)| from < until && time <= *until);
        if other.time.get(k) == Some(&time) && !within {
            rows.push((row, k));
        }
    }
    rows
}

fn largest_difference(own: &Signal, other: &Signal, rows: &[(usize, usize)]) -> f64 {
    let differences = rows.iter().map(|(k, l)| (own.values[*k] - other.values[*l]).abs());
    differences.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_between_an_event_and_its_like_are_left_out() {
        let series = |time: &[f64]| Series { time: time.to_vec(), signals: Vec::new() };
        let (own, other) = (series(&[0.0, 1.0, 2.0, 3.0, 4.0]), series(&[0.0, 1.0, 1.5, 2.0, 3.0, 4.0]));
        let event = |time: f64| Event { time, what: "a slips forward".into() };
        let gaps = gaps(&[event(1.0), event(1.0), event(3.5)], &[event(1.0), event(2.0), event(3.6)]).expect("alike");
        // An event that both have at 1 s, one that comes at 1 s here and at 2 s there, one between two rows.
        assert_eq!(gaps, [(1.0, 1.0), (1.0, 2.0), (3.5, 3.6)]);
        assert_eq!(common_rows(&own, &other, &gaps), [(0, 0), (3, 4), (4, 5)]);
        assert_eq!(common_rows(&own, &other, &[(1.0, 1.0)]).len(), 5);
        assert!(super::gaps(&[event(1.0)], &[]).is_none());
    }
}
