//! The estimate of a run's error against runs at a tolerance near rounding.

use kardan::results::{Run, Study};
use kardan::simulate::Method;
use kardan::study::{Project, Settings, Silent};

use super::common::runs_only;

fn study(model: &str, tolerance: f64, method: Method, runs: bool) -> Study {
    let settings = Settings { tolerance: Some(tolerance), method, runs_only: runs, ..runs_only() };
    Project::open(kardan::model::builtin(model).unwrap().source).run(&settings, &Silent).expect("built in")
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
                assert_eq!((found.tolerance, found.looser), (tolerance, 10.0 * tolerance));
                assert!(found.same_events || tolerance > 1e-7, "{model} {}: other events", run.name);
                for worst in &found.errors {
                    let error = difference(run, exact, &worst.signal);
                    let told = format!("{model} {}, {method:?}, {tolerance:e}: {worst:?}, error {error:e}", run.name);
                    assert!(error <= worst.error, "{told}");
                    assert!(!found.same_events || worst.error <= 30.0 * error + 1e-12, "{told}");
                }
            }
        }
    }
}

#[test]
fn runs_alone_are_not_estimated() {
    let study = study("two-bodies", 1e-8, Method::Taylor, true);
    assert!(study.runs.iter().all(|run| run.accuracy.is_none()));
}

/// Tolerances near what doubles give: no method makes many times more steps, all agree, and the run says so.
#[test]
fn tolerances_below_rounding_are_told_and_cost_little() {
    for (model, method) in [
        ("sia-steering", Method::Dop853),
        ("sia-steering", Method::Radau),
        ("harmonic-drive-spring", Method::Dop853),
        ("harmonic-drive-spring", Method::Radau),
    ] {
        let (usual, tight) = (study(model, 1e-10, method, true), study(model, 1e-13, method, true));
        let reference = study(model, 1e-13, Method::Taylor, true);
        for ((usual, tight), reference) in usual.runs.iter().zip(&tight.runs).zip(&reference.runs) {
            let told = format!("{model} {}, {method:?}", tight.name);
            let (few, many) = (usual.effort.steps, tight.effort.steps);
            assert!(many < 20 * few, "{told}: {few}, {many} steps");
            let said = tight.notes.iter().any(|note| note.contains("below what double precision gives"));
            assert!(model != "sia-steering" || said && tight.effort.rounding > 1.0, "{told}: {:?}", tight.notes);
            assert!(!usual.notes.iter().any(|note| note.contains("double precision")), "{told}: {:?}", usual.notes);
            for signal in tight.series.signals.iter().filter(|signal| signal.name.ends_with(".phi")) {
                let error = difference(tight, reference, &signal.name);
                let size = signal.values.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
                // What stands but for rounding is not compared.
                assert!(size < 1e-9 || error < 1e-9 * size, "{told}: {} {error:e} of {size}", signal.name);
            }
        }
    }
}

/// Where rounding decides about the errors, a run at a looser tolerance is as wrong as the run itself, and the estimate knows it.
#[test]
fn the_estimate_holds_below_rounding() {
    let exact = study("sia-steering", 1e-13, Method::Taylor, true);
    let rounded = study("sia-steering", 1e-13, Method::Dop853, false);
    for (run, exact) in rounded.runs.iter().zip(&exact.runs) {
        let found = run.accuracy.as_ref().expect("an estimate");
        assert!(found.rounded, "{}: {}", run.name, run.effort.rounding);
        for worst in &found.errors {
            let error = difference(run, exact, &worst.signal);
            assert!(error <= worst.error, "{}: {worst:?}, error {error:e}", run.name);
        }
    }
}
