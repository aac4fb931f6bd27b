//! The error of a run, estimated by a second run, and by a third one where counts of sensors decide.

use kardan_results::{
    Accuracy, Effort, Event, IntegrationMethod, Outcome, Physical, Run, Series, Signal, SignalError, UndecidedCount,
    UnreliableSignal,
};
use kardan_simulate::{Method, RunResult, Tolerance};

/// How much looser the second run is.
const LOOSER: f64 = 10.0;
/// Fraction of the difference that counts as the error of the run. Errors proportional to the tolerance would be a ninth of it; a
/// third is safe where they follow the tolerance less well, and where both runs are near the rounding of numbers.
const PART: f64 = 1.0 / 3.0;
/// The same where rounding dominates the error of a run: no tolerance reduces it, and both errors have the same size.
const PART_OF_ROUNDING: f64 = 3.0;
/// The same where sensor counts decide: the runs diverge, and neither is closer to the true one. Of 13 runs of each variant of
/// `steering-on-road`, at tolerances from 1e-6 to 1e-13 and by two methods, a third one was farther from the first than ten times the second in
/// 1.5 of 100 cases, most of them where the first two diverged late; a third run covers these.
const PART_OF_COUNTS: f64 = 10.0;
/// An error that is this part of a signal shows in its first digit.
const FIRST_DIGIT: f64 = 0.1;
/// A signal that is a smaller fraction of the largest of its unit is judged as one of that size: it may be the rounding residue of the large ones.
const SMALL: f64 = 1e-3;
/// Above this fraction of the looser tolerance, errors are distinguished from rounding, in SI units, and of charges and currents.
const NOISE: f64 = 1e-2;
const NOISE_OF_CHARGES: f64 = 1e-8;
/// Kinds of signals whose errors show how reliable a run is.
const MOTIONS: [Physical; 6] =
    [Physical::Angle, Physical::Speed, Physical::Position, Physical::Velocity, Physical::Charge, Physical::Current];
/// Ratio of the steps of the second run to those of the first, above which samples determine the steps and not the tolerance.
const SAMPLE_LIMITED: f64 = 0.9;

/// The tolerance of the second run. It changes in discrete steps: exponentials have no tolerance that could be looser.
pub(in crate::study) fn looser(tolerance: Tolerance) -> Tolerance {
    let method = match tolerance.method {
        Method::Automatic => Method::Stepping,
        method => method,
    };
    Tolerance { relative: LOOSER * tolerance.relative, absolute: LOOSER * tolerance.absolute, method, ..tolerance }
}

/// Estimated errors of a run from the difference to a second run, at a looser tolerance, and to a third one, in which undecided readings
/// take their other value; none where one of them ended early. `undecided`: the first of these readings. Readings of sensors are left
/// out: they are copies of other signals, and where they are rounded to counts they jump by one.
pub(in crate::study) fn estimate(
    run: &Run,
    (second, third): (&RunResult, Option<&RunResult>),
    undecided: Option<UndecidedCount>,
    tolerance: Tolerance,
    readings: &[String],
) -> Option<Accuracy> {
    let all = || [second].into_iter().chain(third).map(|other| &other.run);
    if run.outcome != Outcome::Completed || all().any(|other| other.outcome != Outcome::Completed) {
        return None;
    }
    let gaps_to = |other: &Run| gaps(&run.events, &other.events);
    let rows = |other: &Run| common_rows(&run.series, &other.series, &gaps_to(other).unwrap_or_default());
    let compared: Vec<_> = all().map(|other| (&other.series.signals, rows(other))).collect();
    let mut errors: Vec<SignalError> = Vec::new();
    let mut sized: Vec<UnreliableSignal> = Vec::new();
    // Series steps ignore the tolerance.
    let rounded = |effort: &Effort| effort.rounding > 1.0 && effort.method != IntegrationMethod::Taylor;
    let cut = second.sampled && second.run.effort.steps as f64 > SAMPLE_LIMITED * run.effort.steps as f64;
    let rounded = cut || rounded(&run.effort) || rounded(&second.run.effort);
    let part = match (&undecided, rounded) {
        (Some(_), _) => PART_OF_COUNTS,
        (None, true) => PART_OF_ROUNDING,
        (None, false) => PART,
    };
    let signals = run.series.signals.iter().enumerate().filter(|(_, signal)| !readings.contains(&signal.name));
    for (number, signal) in signals {
        // The other runs do not contain signals computed by expressions.
        let reference_runs = compared.iter().filter_map(|(signals, rows)| Some((signals.get(number)?, rows)));
        let differences = reference_runs.map(|(other, rows)| largest_difference(signal, other, rows));
        let Some(difference) = differences.reduce(f64::max) else { continue };
        let error = part * difference;
        let unit = signal.physical;
        let own = || SignalError { signal: signal.name.clone(), unit, error };
        let size = signal.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        if MOTIONS.contains(&unit) {
            // Torques and controller decisions jump, a moment earlier or later; the error from counts measures how far trajectories
            // differ, not how wrong one is.
            sized.push(UnreliableSignal { signal: signal.name.clone(), unit, error: part.min(1.0) * difference, size });
        }
        match errors.iter_mut().find(|existing| existing.unit == unit) {
            Some(existing) if existing.error >= error => {}
            Some(existing) => *existing = own(),
            None => errors.push(own()),
        }
    }
    let looser = LOOSER * tolerance.relative;
    let same_events = gaps_to(&second.run).is_some();
    let unreliable = least_reliable(sized, looser);
    Some(Accuracy {
        tolerance: tolerance.relative,
        comparison_tolerance: looser,
        same_events,
        limited_by_rounding: rounded,
        quantisation_ambiguity: undecided,
        errors,
        unreliable,
    })
}

/// The signal with the largest error relative to its size, if that affects its first digit.
fn least_reliable(signals: Vec<UnreliableSignal>, looser: f64) -> Option<UnreliableSignal> {
    let largest = |unit: Physical| {
        let own = signals.iter().filter(|other| other.unit == unit).map(|other| other.size);
        own.fold(0.0, f64::max)
    };
    let noise = |unit: Physical| match unit {
        Physical::Charge | Physical::Current => NOISE_OF_CHARGES * looser,
        _ => NOISE * looser,
    };
    let part = |one: &UnreliableSignal| one.error / one.size.max(SMALL * largest(one.unit));
    let shows = |one: &&UnreliableSignal| one.error > noise(one.unit) && part(one) >= FIRST_DIGIT;
    signals.iter().filter(shows).max_by(|a, b| part(a).total_cmp(&part(b))).cloned()
}

/// Warnings about the numbers of a run from the comparison with a second run.
pub(in crate::study) fn accuracy_warnings(run: &Run, second: &Run) -> Vec<String> {
    let Some(found) = &run.accuracy else {
        return match (&run.outcome, &second.outcome) {
            (Outcome::Completed, Outcome::Failed { cause, .. } | Outcome::Unbalanced { cause }) => vec![format!(
                "its errors cannot be estimated: a second run, at a tolerance that is {LOOSER} times as large, does not reach its end with an energy balance \
                 that closes ({cause})"
            )],
            _ => Vec::new(),
        };
    };
    let unreliable = found.unreliable.iter().map(|UnreliableSignal { signal, unit, error, size }| {
        let [error, size] = [error, size].map(|x| format!("{x:.2e} {}", unit.unit()).trim_end().to_string());
        format!(
            "the estimated error of {signal} is {error}, of a signal of at most {size}: not even its first digit is \
             reliable"
        )
    });
    // Where sensor counts decide, no tolerance shows which events are right; the error measures the distance of the trajectories.
    let event_note = (!found.same_events && found.quantisation_ambiguity.is_none()).then(|| {
        format!(
            "a second run, at a tolerance that is {LOOSER} times as large, passes other events, or events in another \
             order: a smaller `--tolerance` shows which are right"
        )
    });
    unreliable.chain(event_note).collect()
}

/// The time differences between corresponding events, if both runs have the same ones.
fn gaps(own: &[Event], other: &[Event]) -> Option<Vec<(f64, f64)>> {
    let same = own.len() == other.len() && own.iter().zip(other).all(|(a, b)| a.description == b.description);
    same.then(|| own.iter().zip(other).map(|(a, b)| (a.time.min(b.time), a.time.max(b.time))).collect())
}

/// Rows of both runs at the same times, outside of the gaps.
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
        // Values at an event are those after it; one run may be past it already.
        let mut begun = gaps[gap..].iter().take_while(|(from, _)| *from <= time);
        let in_gap = begun.any(|(from, until)| from < until && time <= *until);
        if other.time.get(k) == Some(&time) && !in_gap {
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
#[path = "../../../tests/unit/study/run/accuracy.rs"]
mod tests;
