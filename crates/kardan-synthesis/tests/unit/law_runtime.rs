//! Tests of `src/law_runtime.rs`.

use super::*;

/// Doubles the reference; no result where that is not a number.
struct Doubler;

impl Block for Doubler {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        out[0] = 2.0 * observation.references[0];
        out[0].is_finite()
    }

    fn states(&mut self, observation: Observation<'_>, _: &[f64], out: &mut [f64]) -> bool {
        self.command(observation, out)
    }
}

fn observation<'a>(reference: &'a [f64], states: &'a [f64]) -> Observation<'a> {
    Observation { time: 0.0, angles: &[], speeds: &[], disturbances: &[], references: reference, readings: &[], states }
}

#[test]
fn an_invalid_result_freezes_a_sampled_law_and_is_nan_in_a_continuous_one() {
    let clock = Clock { period: 1e-3, delay: 0.0, single: false };
    let (mut sampled, mut continuous) =
        (LawRuntime::new(Box::new(Doubler), Some(clock), 1), LawRuntime::new(Box::new(Doubler), None, 1));
    let (mut command, mut state) = ([0.0], [0.0]);
    for (reference, invalid, expected) in [(1.5, false, 3.0), (f64::NAN, true, 3.0), (-2.0, false, -4.0)] {
        sampled.command(observation(&[reference], &[7.0]), &mut command);
        sampled.next(observation(&[reference], &[7.0]), &[], &mut state);
        assert_eq!((command[0], state[0]), (expected, if invalid { 7.0 } else { expected }));
        let health = sampled.health();
        assert_eq!((health.commands_bounded, health.estimate_frozen), (usize::from(invalid), invalid));
        continuous.command(observation(&[reference], &[7.0]), &mut command);
        continuous.rates(observation(&[reference], &[7.0]), &[], &mut state);
        assert_eq!([command[0], state[0]].map(f64::is_nan), [invalid; 2]);
        assert!(invalid || command == state && command[0] == 2.0 * reference);
    }
}

#[test]
fn frozen_commands_are_part_of_a_snapshot() {
    let clock = Clock { period: 1e-3, delay: 0.0, single: false };
    let mut one = LawRuntime::new(Box::new(Doubler), Some(clock), 1);
    one.command(observation(&[4.0], &[]), &mut [0.0]);
    let mut archive = StateArchive::taking();
    one.archive_state(&mut archive);
    let data = archive.data();
    let mut restored = LawRuntime::new(Box::new(Doubler), Some(clock), 1);
    let mut archive = StateArchive::putting(&data);
    restored.archive_state(&mut archive);
    assert!(archive.fits());
    let mut command = [0.0];
    restored.command(observation(&[f64::NAN], &[]), &mut command);
    assert_eq!(command, [8.0]);
}
