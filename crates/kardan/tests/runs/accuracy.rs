//! The estimate of a run's error against runs at a tolerance near rounding.

use kardan::results::{Physical, Run, Study};
use kardan::simulate::Method;
use kardan::study::{Settings, Silent};

use super::common::runs_only;

fn study(model: &str, tolerance: f64, method: Method, runs: bool) -> Study {
    study_of(kardan::model::builtin(model).unwrap().source, &[], tolerance, method, runs)
}

fn study_of(source: &str, variants: &[&str], tolerance: f64, method: Method, runs: bool) -> Study {
    let variants = variants.iter().map(ToString::to_string).collect();
    let settings = Settings { variants, tolerance: Some(tolerance), method, runs_only: runs, ..runs_only() };
    crate::common::project(source).run(&settings, &Silent).expect("a model without mistakes")
}

/// The largest difference of a signal at the times of both, away from events, where values jump.
fn difference(one: &Run, other: &Run, name: &str) -> f64 {
    let (a, b) = (one.series.signal(name).unwrap(), other.series.signal(name).unwrap());
    let calm = |t: f64| one.events.iter().chain(&other.events).all(|event| (event.time - t).abs() > 1e-6);
    let rows = one.series.time.iter().enumerate().filter(|(_, t)| calm(**t));
    let both = rows.filter_map(|(k, t)| Some((k, other.series.time.binary_search_by(|s| s.total_cmp(t)).ok()?)));
    both.map(|(k, l)| (a.values[k] - b.values[l]).abs()).fold(0.0, f64::max)
}

#[test]
fn the_estimate_is_near_the_error() {
    for (model, method) in
        [("two-bodies", Method::Taylor), ("two-bodies", Method::Dop853), ("sia-steering", Method::Taylor)]
    {
        let exact = study(model, 1e-13, method, true);
        for tolerance in [1e-6, 1e-8] {
            let study = study(model, tolerance, method, false);
            for (run, exact) in study.runs.iter().zip(&exact.runs) {
                let found = run.accuracy.as_ref().expect("an estimate");
                assert_eq!((found.tolerance, found.comparison_tolerance), (tolerance, 10.0 * tolerance));
                assert!(found.same_events || tolerance > 1e-7, "{model} {}: other events", run.name);
                for worst in &found.errors {
                    let error = difference(run, exact, &worst.signal);
                    let reported =
                        format!("{model} {}, {method:?}, {tolerance:e}: {worst:?}, error {error:e}", run.name);
                    assert!(error <= worst.error, "{reported}");
                    assert!(!found.same_events || worst.error <= 30.0 * error + 1e-12, "{reported}");
                }
            }
        }
    }
}

#[test]
fn runs_only_gives_no_accuracy_estimate() {
    let study = study("two-bodies", 1e-8, Method::Taylor, true);
    assert!(study.runs.iter().all(|run| run.accuracy.is_none()));
}

/// Tolerances near what doubles give: no method makes many times more steps, all agree, and the run says so.
#[test]
fn tolerances_below_rounding_are_reported_and_cost_little() {
    for (model, method) in [
        ("sia-steering", Method::Dop853),
        ("sia-steering", Method::Radau),
        ("harmonic-drive-spring", Method::Dop853),
        ("harmonic-drive-spring", Method::Radau),
    ] {
        let (usual, tight) = (study(model, 1e-10, method, true), study(model, 1e-13, method, true));
        let reference = study(model, 1e-13, Method::Taylor, true);
        for ((usual, tight), reference) in usual.runs.iter().zip(&tight.runs).zip(&reference.runs) {
            let reported = format!("{model} {}, {method:?}", tight.name);
            let (usual_steps, tight_steps) = (usual.effort.steps, tight.effort.steps);
            assert!(tight_steps < 20 * usual_steps, "{reported}: {usual_steps}, {tight_steps} steps");
            let has_rounding_note = tight.notes.iter().any(|note| note.contains("below double precision"));
            assert!(
                model != "sia-steering" || has_rounding_note && tight.effort.rounding > 1.0,
                "{reported}: {:?}",
                tight.notes
            );
            assert!(!usual.notes.iter().any(|note| note.contains("double precision")), "{reported}: {:?}", usual.notes);
            for signal in tight.series.signals.iter().filter(|signal| signal.name.ends_with(".phi")) {
                let error = difference(tight, reference, &signal.name);
                let size = signal.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                // What stands but for rounding is not compared.
                assert!(size < 1e-9 || error < 1e-9 * size, "{reported}: {} {error:e} of {size}", signal.name);
            }
        }
    }
}

/// Where rounding decides about the errors, a run at a looser tolerance is as wrong as the run itself, and the estimate knows it.
#[test]
fn the_estimate_is_valid_below_rounding() {
    let exact = study("sia-steering", 1e-13, Method::Taylor, true);
    let rounded = study("sia-steering", 1e-13, Method::Dop853, false);
    for (run, exact) in rounded.runs.iter().zip(&exact.runs) {
        let found = run.accuracy.as_ref().expect("an estimate");
        assert!(found.limited_by_rounding, "{}: {}", run.name, run.effort.rounding);
        for worst in &found.errors {
            let error = difference(run, exact, &worst.signal);
            assert!(error <= worst.error, "{}: {worst:?}, error {error:e}", run.name);
        }
    }
}

/// Where samples cut the steps short, their errors are those of rounding, and two runs at two tolerances share them: the estimate holds all the same.
#[test]
fn the_estimate_is_valid_where_samples_limit_the_steps() {
    let source = kardan::model::builtin("sia-steering-ecu").unwrap().source;
    let variants = ["rack", "rack-single", "turn-30deg"];
    let exact = study_of(source, &variants, 1e-13, Method::Taylor, true);
    for (run, exact) in study_of(source, &variants, 1e-10, Method::Taylor, false).runs.iter().zip(&exact.runs) {
        let found = run.accuracy.as_ref().expect("an estimate");
        assert!(found.limited_by_rounding && found.quantisation_ambiguity.is_none(), "{}: {found:?}", run.name);
        for worst in &found.errors {
            let error = difference(run, exact, &worst.signal);
            assert!(error <= worst.error, "{}: {worst:?}, error {error:e}", run.name);
            assert!(worst.error < 1e-9, "{}: {worst:?}", run.name);
        }
    }
}

/// A pendulum that a sampled law holds up by an encoder of 0.01 rad, let go at an angle, with a tip that swings fast.
fn quantised_pendulum(angle: f64) -> String {
    format!(
        "[shaft.arm]\ninertia = \"1 kg m^2\"\ndamping = \"5 N m s/rad\"\n[motor.m]\nshaft = \"arm\"\n\
         [shaft.tip]\ninertia = \"0.1 kg m^2\"\n\
         [spring_damper.rod]\nshaft_1 = \"arm\"\nshaft_2 = \"tip\"\nstiffness = \"1000 N m/rad\"\ndamping = \"0.1 N m s/rad\"\n\
         [torque.weight]\nshaft = \"arm\"\nlaw = \"40 N m * sin(arm.phi)\"\n\
         [sensor.encoder]\nmeasures = \"angle\"\nshaft = \"arm\"\nresolution = \"0.01 rad\"\n\
         [control.hold]\nlaw = \"program\"\ncommands = {{ m = \"-80 N m/rad * encoder.phi\" }}\nsample_time = \"50 ms\"\n\
         [scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\ninitial = {{ \"arm.phi\" = \"{angle:?} rad\", \"tip.w\" = \"5 rad/s\" }}\n"
    )
}

/// A tolerance at which the errors of a run are well above rounding, and one at which they are below.
const LOOSE: f64 = 1e-5;
const TIGHT: f64 = 1e-13;

fn pendulum_run(angle: f64, tolerance: f64, runs: bool) -> Run {
    study_of(&quantised_pendulum(angle), &[], tolerance, Method::Dop853, runs).runs.remove(0)
}

/// An angle between two at which the counts of a run change.
fn where_counts_change(mut low: f64, mut high: f64, tolerance: f64) -> f64 {
    // What the law reads, each 50 ms, early enough to do something.
    let counts = |angle: f64| -> Vec<f64> {
        let series = pendulum_run(angle, tolerance, true).series;
        let read = series.signal("encoder.phi").expect("a column of the sensor").values.iter().zip(&series.time);
        read.filter(|(_, time)| **time < 0.7 && (*time / 0.05 - (*time / 0.05).round()).abs() < 1e-9)
            .map(|(count, _)| *count)
            .collect()
    };
    let (first, last) = (counts(low), counts(high));
    assert_ne!(first, last, "{low} and {high} have the same counts");
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        if counts(middle) == first { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Runs begin at angles around that at which a count changes: where the count of a run is not that of the true motion, and the second run makes the same
/// mistake, the error told is still that of one count. Away from there it is that of the tolerance.
#[test]
fn quantisation_ambiguity_is_in_the_estimate() {
    let (low, high) = (0.201, 0.209);
    let [loose, tight] = [LOOSE, TIGHT].map(|tolerance| where_counts_change(low, high, tolerance));
    let apart = loose - tight;
    assert!(apart.abs() > 1e-10 && apart.abs() < 1e-5, "counts change at {loose} and {tight}");
    let mut mistaken = 0;
    for part in [-300.0, -1.0, -0.3, 0.1, 0.5, 0.9, 1.3, 2.0, 300.0] {
        let angle = tight + part * apart;
        let (run, exact) = (pendulum_run(angle, LOOSE, false), pendulum_run(angle, TIGHT, true));
        let found = run.accuracy.as_ref().expect("an estimate");
        for worst in &found.errors {
            let error = difference(&run, &exact, &worst.signal);
            assert!(error <= worst.error, "{part}: {worst:?}, error {error:e}, {:?}", found.quantisation_ambiguity);
        }
        let reported = found.errors.iter().find(|worst| worst.unit == Physical::Angle).expect("an angle").error;
        let error = difference(&run, &exact, "arm.phi");
        if part.abs() > 100.0 {
            assert!(
                found.quantisation_ambiguity.is_none() && reported < 1e-5,
                "{part}: {reported:e}, {:?}",
                found.quantisation_ambiguity
            );
        } else if (0.0..=1.0).contains(&part) {
            // One count is 0.6 N m for 50 ms and more.
            assert!(error > 1e-5, "{part}: the counts are the same, {error:e}");
            mistaken +=
                usize::from(found.quantisation_ambiguity.as_ref().is_some_and(|first| first.sensor == "encoder"));
        }
    }
    assert_eq!(mistaken, 3);
}
