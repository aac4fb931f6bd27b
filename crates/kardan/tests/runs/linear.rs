//! With `--method automatic` loops that are linear between the breakpoints of the scenario are solved by matrix exponentials: the same motion as by the reference
//! method at its tightest, whatever stands in the loop.

use kardan::results::{Outcome, Run};
use kardan::simulate::{Method, Scenario, Setup, Tolerance, simulate};
use kardan::study::{self, Settings, Silent};

use super::common::{project, runs_only};

fn runs(source: &str, method: Method, tolerance: Option<f64>) -> Vec<Run> {
    let settings = Settings { method, tolerance, ..runs_only() };
    let study = project(source).run(&settings, &Silent);
    study.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}\n{source}")).runs
}

/// Largest difference of a signal in two runs, in parts of the largest value of all signals of its kind; and which one it is.
fn difference(one: &Run, other: &Run) -> (f64, String) {
    assert_eq!(one.series.time, other.series.time);
    let mut worst = (0.0, String::new());
    for signal in &one.series.signals {
        let same_kind = one.series.signals.iter().filter(|other| other.physical == signal.physical);
        let size = same_kind.flat_map(|other| &other.values).fold(0.0f64, |most, x| most.max(x.abs()));
        let counterpart = other.series.signal(&signal.name).unwrap();
        assert_eq!(signal.values.len(), counterpart.values.len(), "{}", signal.name);
        for (a, b) in signal.values.iter().zip(&counterpart.values) {
            let part = (a - b).abs() / size.max(f64::MIN_POSITIVE);
            if part > worst.0 {
                worst = (part, signal.name.clone());
            }
        }
    }
    worst
}

/// All signals of the last variant of a model at these times, by matrix exponentials.
fn rows_at(source: &str, times: &[f64]) -> Run {
    let (prepared, diagnostics) = study::prepare(source);
    let variant = prepared.variants.last().unwrap_or_else(|| panic!("{diagnostics:?}"));
    let scenario = Scenario { times: times.to_vec(), ..variant.scenario.clone() };
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &scenario };
    let tolerance = Tolerance { method: Method::Automatic, ..Tolerance::default() };
    simulate(setup, tolerance, &mut |_| None)
}

/// Whether the run took hardly more steps than the scenario has breakpoints.
fn was_exact(run: &Run) -> bool {
    run.effort.steps <= 50
}

/// A motor with a lag drives two shafts over a spring; the references and a disturbance rise in ramps, and a law follows them.
const RAMPS: &str = r#"
[model]
name = "ramps"

[shaft.a]
inertia = "0.02 kg m^2"
damping = "0.01 N m s/rad"

[shaft.b]
inertia = "0.1 kg m^2"
damping = "0.05 N m s/rad"

[spring_damper.k]
shaft_1 = "a"
shaft_2 = "b"
stiffness = "20 N m/rad"
damping = "0.1 N m s/rad"

[motor.m]
shaft = "a"
lag = "3 ms"

[motor.n]
shaft = "b"

[disturbance.load]
shaft = "b"

[control.follow]
law = "noninteracting"

[[control.follow.channels]]
output = "b.phi"
input = "n"
kind = "position"
reference = "r"

[scenario]
duration = "1.5 s"
output_step = "2 ms"

[[scenario.event]]
at = "0.1 s"
signal = "r"
to = "1 rad"
over = "0.4 s"

[[scenario.event]]
at = "0.3 s"
signal = "load"
to = "-2 N m"
over = "0.3 s"

[[scenario.event]]
at = "0.7 s"
signal = "m.tau"
to = "0.5 N m"
"#;

/// The stiff drive cancels its own fast motion: the order of the sums in the equations alone changes its torques by 5e-7 of their size
/// (measured with both methods at 1e-13), so that no more can be asked.
#[test]
fn linear_loops_move_as_with_the_reference_method() {
    let builtin = |name: &str| kardan::model::builtin(name).unwrap().source.to_string();
    for (source, allowed) in [
        (builtin("two-bodies"), 1e-11),
        (builtin("rlc-ladder"), 1e-9),
        (builtin("harmonic-drive-spring"), 1e-6),
        (RAMPS.to_string(), 1e-10),
    ] {
        let reference = runs(&source, Method::Dop853, Some(1e-13));
        let exact = runs(&source, Method::Automatic, Some(1e-10));
        for (one, other) in reference.iter().zip(&exact) {
            assert!(was_exact(other) && !was_exact(one), "{}: {:?} {:?}", one.name, one.effort, other.effort);
            let (worst, signal) = difference(one, other);
            assert!(worst < allowed, "{} {signal}: {worst:e}", one.name);
            for (a, b) in [
                (one.energy.input, other.energy.input),
                (one.energy.dissipated, other.energy.dissipated),
                (one.energy.stored, other.energy.stored),
            ] {
                assert!((a - b).abs() < 1e-9 * one.energy.input.abs(), "{}: {a} {b}", one.name);
            }
            let residual = other.energy.residual.abs();
            assert!(residual < 1e-9 * other.energy.input.abs(), "{}: {residual:e}", other.name);
        }
    }
}

/// Readings with a resolution at times of their own are those of the reference method.
#[test]
fn sensors_read_in_linear_loops() {
    let source = RAMPS.replace(
        "[scenario]",
        "[sensor.encoder]\nmeasures = \"angle\"\nshaft = \"b\"\nresolution = \"0.01 rad\"\nsample_time = \"7 ms\"\n\n[scenario]",
    );
    let (reference, exact) =
        (&runs(&source, Method::Dop853, Some(1e-13))[0], &runs(&source, Method::Automatic, None)[0]);
    assert!(was_exact(exact));
    let readings = |run: &Run| run.series.signal("encoder.phi").unwrap().values.clone();
    assert_eq!(readings(reference), readings(exact));
    assert!(readings(exact).iter().any(|x| *x > 0.5));
}

/// What grows without bound is left to the reference method, which tells when it does; and what is not linear, always.
#[test]
fn diverging_and_nonlinear_models_are_integrated() {
    let growing = r#"
[model]
name = "growing"

[shaft.a]
inertia = "1 kg m^2"

[motor.m]
shaft = "a"

[scenario]
duration = "2 s"

[[scenario.event]]
at = "0.1 s"
signal = "m.tau"
to = "1e7 N m"
"#;
    let ends: Vec<Run> =
        [Method::Taylor, Method::Automatic].into_iter().map(|method| runs(growing, method, None).remove(0)).collect();
    assert_eq!(ends[0].outcome, ends[1].outcome);
    assert!(
        matches!(&ends[1].outcome, Outcome::Failed { cause, .. } if cause.contains("grows without bound")),
        "{:?}",
        ends[1].outcome
    );
    assert_eq!(ends[0].series.time, ends[1].series.time);
    let friction = RAMPS.replace("inertia = \"0.1 kg m^2\"", "inertia = \"0.1 kg m^2\"\nfriction = \"0.1 N m\"");
    let limited = RAMPS.replace("lag = \"3 ms\"", "torque_limit = \"5 N m\"");
    let bent = RAMPS.replace(
        "[shaft.b]",
        "[shaft.c]\n\n[universal_joint.joint]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nangle = \"20 deg\"\n\n[shaft.b]",
    );
    for source in [friction, limited, bent] {
        let [one, other] = [Method::Taylor, Method::Automatic].map(|method| runs(&source, method, None).remove(0));
        assert_eq!(one, other);
        assert!(!was_exact(&one));
    }
}

/// Evenly spaced rows, which are taken eight at once, are those that are taken one by one because others stand between them; also where
/// breakpoints lie between two rows.
#[test]
fn evenly_spaced_rows_are_those_computed_one_by_one() {
    let builtin = |name: &str| kardan::model::builtin(name).unwrap().source.to_string();
    for (source, duration) in [(builtin("two-bodies"), 15.0), (RAMPS.to_string(), 1.5)] {
        for count in [3001, 2998] {
            let even: Vec<f64> = (0..=count).map(|k| duration * f64::from(k) / f64::from(count)).collect();
            let between = even.windows(2).flat_map(|pair| [pair[0], 0.7 * pair[0] + 0.3 * pair[1]]);
            let uneven: Vec<f64> = between.chain([duration]).collect();
            let [one, other] = [&even, &uneven].map(|times| rows_at(&source, times));
            assert!(one.series.time == even && other.series.time == uneven);
            assert!(one.outcome == Outcome::Completed && one.effort.steps <= 50, "{:?}", one.effort);
            for (signal, apart) in one.series.signals.iter().zip(&other.series.signals) {
                let size = signal.values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                for (k, value) in signal.values.iter().enumerate() {
                    let expected = apart.values[2 * k];
                    let place = format!("{} at {} s: {value} {expected}", signal.name, even[k]);
                    assert!((value - expected).abs() <= 1e-12 * size, "{place}");
                }
            }
        }
    }
}
