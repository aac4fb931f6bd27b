//! A bent joint between law and load: the observer on the full model, what is said of the loop before any run, and the built-in study
//! of both laws over the joint angle.

use crate::common::{prepared, run, runs_only, signal};
use kardan::model::builtin;
use kardan::results::{DataMatrix, Design, Outcome, Run, Verdict};
use kardan::study::{self, DesignSettings, Settings, Silent};
use kardan::synthesis::{Law, LinearLaw};
use std::sync::Arc;

const SENSORS: &str = "sensors = [\"rk.phi\", \"fs.phi\", \"wg.phi\"]\nmethod = \"kalman\"\n";

/// The built-in steering at one joint angle: `column` with these keys and this observer, with or without Coulomb friction, for
/// the step of the rack alone.
fn steering(beta: &str, keys: &str, observer: &str, friction: bool, scenario: &str) -> String {
    let source = builtin("sia-steering").expect("built in").source;
    let model = source.split("# ---- the run").next().expect("a model");
    let model = model
        .replace("beta = \"[0, 10, 20, 30] deg\"", &format!("beta = \"[{beta}] deg\""))
        .replacen("design = { beta = \"0 deg\" }", keys, 1)
        .replace("[control.driver_model]", &format!("{observer}\n[control.driver_model]"));
    let model: String = model
        .lines()
        .filter(|line| friction || !line.starts_with("friction ="))
        .map(|line| format!("{line}\n"))
        .collect();
    format!("{model}\n{scenario}")
}

/// The rack turns by half a turn.
const STEP: &str = "\
[scenario]
duration = \"1.2 s\"
output_step = \"1 ms\"

[[scenario.event]]
at = \"0.1 s\"
signal = \"ref_rk\"
to = \"180 deg\"
";

fn observer(keys: &str) -> String {
    format!("[control.column.observer]\n{SENSORS}{keys}\n")
}

fn largest(run: &Run, name: &str) -> f64 {
    signal(run, name).iter().fold(0.0, |max, x| max.max(x.abs()))
}

/// What `check` says, but for the torques that these scenarios leave at zero.
fn codes(source: &str) -> Vec<String> {
    let reported = study::check(source).into_iter().map(|diagnostic| diagnostic.code.to_string());
    reported.filter(|code| code != "table::unused").collect()
}

fn designed(source: &str) -> Design {
    study::design(source, &DesignSettings::default(), &Silent).expect("a design")
}

/// Behind an observer on the full model the driver feels less than 0.05 N m of the rack, whatever the law; with the nonlinear law
/// and without friction, where copy and plant are the same, nothing.
#[test]
fn the_driver_feels_nothing_behind_an_observer_on_the_full_model() {
    for plant in ["linear", "nonlinear"] {
        for beta in ["10", "20", "30"] {
            for (friction, keys) in [(false, "disturbances = []"), (true, "disturbances = [\"fs\"]")] {
                let law = format!("plant = \"{plant}\"");
                let run = run(&steering(beta, &law, &observer(keys), friction, STEP));
                assert_eq!(run.outcome, Outcome::Completed);
                let felt = largest(&run, "driver.tau");
                let bound = if plant == "nonlinear" && !friction { 1e-9 } else { 0.05 };
                assert!(felt < bound, "{plant}, {beta} deg, {keys}, friction {friction}: {felt}");
                let end = signal(&run, "rk.phi").last().copied().expect("rows");
                assert!((end - std::f64::consts::PI).abs() < 2e-3, "the rack arrives: {end}");
            }
        }
    }
}

/// An observer on the linear model: what the run shows (37 N m at 20 deg) is told before it, and no proof is claimed for it.
#[test]
fn a_linear_observer_is_reported_before_any_run() {
    let bent = |beta: &str, keys: &str| steering(beta, "plant = \"nonlinear\"", &observer(keys), false, STEP);
    let linear = "plant = \"linear\"\ndisturbances = []";
    let felt = largest(&run(&bent("20", linear)), "driver.tau");
    assert!(felt > 5.0, "{felt}");
    assert_eq!(codes(&bent("20", linear)), ["control::coupled-at-position"]);
    assert_eq!(codes(&bent("30", linear)), ["control::unstable-at-position"]);
    let design = designed(&bent("20", linear));
    let loop_along_path = design.loop_along_path.as_ref().expect("a bent joint");
    assert_eq!(
        (loop_along_path.rotated_coordinates.as_str(), loop_along_path.positions, loop_along_path.stable),
        ("rk and cj", 24, true)
    );
    let Verdict { sound: good, text: verdict } = design.verdict();
    assert!(!good, "{verdict}");
    assert!(verdict.contains("proven exactly for the linear design model and the true state; "), "{verdict}");
    assert!(verdict.contains("at the joint positions of the variant it is coupled"), "{verdict}");
    assert!(
        design.warnings.iter().any(|warning| warning.contains("ref_rk by 3.1416 rad moves driver.tau")),
        "{design:?}"
    );
    let design = designed(&bent("30", linear));
    assert!(
        !design.verdict().sound && design.verdict().text.contains("the loop is unstable"),
        "{}",
        design.verdict().text
    );
    // The run at 30 deg runs away.
    assert!(largest(&run(&bent("30", linear)), "driver.tau") > 200.0);
    // On the full model nothing is to be said; nor with a straight joint, where both are one.
    assert!(codes(&bent("30", "disturbances = [\"fs\"]")).is_empty());
    assert!(codes(&bent("0", "plant = \"linear\"\ndisturbances = [\"fs\"]")).is_empty());
    let straight = designed(&bent("0", "disturbances = [\"fs\"]"));
    assert!(straight.loop_along_path.is_none());
    assert!(straight.verdict().text.contains("proven exactly for the true state;"), "{}", straight.verdict().text);
}

/// A law designed for another joint angle, without an observer: the claim holds for its design model, and the coupling is said.
#[test]
fn a_proof_for_another_angle_is_not_one_for_this() {
    let source = steering("30", "design = { beta = \"0 deg\" }", "", false, STEP);
    let design = designed(&source);
    let verdict = design.verdict().text;
    assert!(
        verdict.contains("proven exactly for the linear design model; at the joint positions of the variant"),
        "{verdict}"
    );
    let found = design.loop_along_path.expect("a bent joint");
    let felt = found.interactions.iter().find(|one| one.signal == "driver.tau").expect("the driver is there");
    assert!(felt.largest > 1e-4, "{felt:?}");
    // The law on the full model at the variant's own angle is decoupled there, but for rounding and differences.
    let design = designed(&steering("30", "plant = \"nonlinear\"", "", false, STEP));
    let found = design.loop_along_path.expect("a bent joint");
    assert!(found.stable && found.interactions.iter().all(|one| one.largest < 1e-6), "{found:?}");
}

/// What the linearised loop says of a step where the joint stands is what the nonlinear run shows of a small one there.
#[test]
fn a_small_step_at_the_joint_position() {
    let scenario = "\
[scenario]
duration = \"1.2 s\"
output_step = \"0.5 ms\"
initial = { \"rk.phi\" = \"90 deg\", \"cj.phi\" = \"90 deg\" }

[[scenario.event]]
at = \"0 s\"
signal = \"ref_rk\"
to = \"90 deg\"

[[scenario.event]]
at = \"0.2 s\"
signal = \"ref_rk\"
to = \"90.01 deg\"
";
    let source = steering("30", "plant = \"linear\"", &observer("disturbances = [\"fs\"]"), false, scenario);
    let run = run(&source);
    let found = designed(&source).loop_along_path.expect("a bent joint");
    let felt = found.interactions.iter().find(|one| one.signal == "driver.tau").expect("the driver is there");
    assert!((felt.at - std::f64::consts::FRAC_PI_2).abs() < 1e-9, "{felt:?}");
    let per_step = largest(&run, "driver.tau") / 0.01f64.to_radians();
    let predicted = felt.largest / felt.step;
    assert!((per_step - predicted).abs() < 0.02 * predicted, "{per_step} {predicted}");
}

fn laws(source: &str) -> Vec<Arc<dyn Law>> {
    prepared(source).variants.remove(0).implemented.clone()
}

fn close(one: &LinearLaw, other: &LinearLaw) {
    let pairs = [
        (&one.states, &other.states),
        (&one.angles, &other.angles),
        (&one.speeds, &other.speeds),
        (&one.torques, &other.torques),
        (&one.on_states, &other.on_states),
        (&one.on_angles, &other.on_angles),
        (&one.on_speeds, &other.on_speeds),
        (&one.on_references, &other.on_references),
        (&one.errors, &other.errors),
    ];
    for (a, b) in pairs {
        assert_eq!((a.rows(), a.columns()), (b.rows(), b.columns()));
        let size = b.as_slice().iter().fold(1.0f64, |max, x| max.max(x.abs()));
        for (x, y) in a.as_slice().iter().zip(b.as_slice()) {
            assert!((x - y).abs() < 1e-7 * size, "{x} {y} of {size}");
        }
    }
}

/// On a straight joint the observer on the full model is the linear one, in continuous time and sampled; and of either law the
/// linear part at a position is that at zero where the joint is straight.
#[test]
fn on_a_straight_joint_both_observers_are_one() {
    for clock in ["", "sample_time = \"0.2 ms\"\n"] {
        let law = |plant: &str| {
            let keys = format!("plant = \"{plant}\"\ndisturbances = [\"fs\"]");
            laws(&steering("0", &format!("plant = \"nonlinear\"\n{clock}"), &observer(&keys), false, STEP)).remove(0)
        };
        let (linear, nonlinear) = (law("linear"), law("nonlinear"));
        assert!(nonlinear.is_nonlinear() && !linear.is_nonlinear());
        let own = linear.linear();
        close(&nonlinear.linear(), &own);
        for position in [[0.0; 3], [0.4, -0.7, 1.1]] {
            close(&nonlinear.linear_at(&position, nonlinear.clock()).expect("finite"), &own);
            close(&linear.linear_at(&position, linear.clock()).expect("finite"), &own);
        }
    }
}

/// Sampled, in double precision, and in single with an encoder that gives no number for a while: the last reading is held and told,
/// nothing else but a number comes out. At 5 kHz sampling alone couples the inverting law (0.2 N m, which `check` says).
#[test]
fn sampled_with_missing_readings() {
    let scenario = "\
[scenario]
duration = \"0.2 s\"
output_step = \"1 ms\"

[[scenario.event]]
at = \"0.02 s\"
signal = \"ref_rk\"
to = \"60 deg\"

[sensor.encoder]
measures = \"angle\"
shaft = \"rk\"
";
    let fault = "\n[[scenario.fault]]\nsensor = \"encoder\"\nat = \"0.15 s\"\nuntil = \"0.152 s\"\n";
    let keys = "[control.column.observer]\nsensors = [\"encoder.phi\", \"fs.phi\", \"wg.phi\"]\nmethod = \"kalman\"\ndisturbances = []\n";
    for (precision, fault) in [("double", ""), ("single", fault)] {
        let clock = format!("plant = \"nonlinear\"\nsample_time = \"0.2 ms\"\nprecision = \"{precision}\"");
        let source = steering("30", &clock, keys, false, &format!("{scenario}{fault}"));
        assert_eq!(codes(&source), ["control::coupled-at-position"]);
        let run = run(&source);
        assert_eq!(run.outcome, Outcome::Completed);
        assert!(run.series.signals.iter().all(|signal| signal.values.iter().all(|x| x.is_finite())));
        let felt = largest(&run, "driver.tau");
        assert!(!fault.is_empty() || felt < 0.25, "{precision}: {felt}");
        let reported = run.events.iter().any(|event| event.description.contains("encoder supplies no reading"));
        assert_eq!(reported, !fault.is_empty(), "{:?}", run.events);
    }
}

/// What the nonlinear law cancels is not reported once more by an observer that knows it.
#[test]
fn double_cancellation_is_reported() {
    let both = |law: &str, keys: &str| {
        study::check(&steering("20", law, &observer(keys), true, STEP))
            .iter()
            .map(|d| d.message.clone())
            .collect::<Vec<_>>()
    };
    let reports_double = |found: Vec<String>| found.iter().any(|message| message.contains("cancelled twice"));
    assert!(reports_double(both("plant = \"nonlinear\"", "plant = \"linear\"\ndisturbances = [\"fs\"]")));
    assert!(!reports_double(both("plant = \"nonlinear\"", "disturbances = [\"fs\"]")));
    let friction = "plant = \"nonlinear\"\nfriction_width = \"0.1 rad/s\"";
    assert!(!reports_double(both(friction, "disturbances = [\"fs\"]")));
    assert!(reports_double(both(friction, "plant = \"linear\"\ndisturbances = [\"fs\"]")));
}

/// Its data for firmware: the tables of the block, with Γ for the sample time.
#[test]
fn the_observer_is_exported() {
    let clock = "plant = \"nonlinear\"\nsample_time = \"0.2 ms\"";
    let design = designed(&steering("20", clock, &observer("disturbances = [\"fs\"]"), false, STEP));
    let data = design.observer_data.expect("an observer");
    assert_eq!((data.block.as_str(), data.sample_time), ("ModelObserver", Some(2e-4)));
    assert_eq!(data.writes.len(), 7);
    let rows = |name: &str| {
        data.matrices
            .iter()
            .find(|matrix| matrix.name == name)
            .map(|DataMatrix { values: rows, .. }| rows)
            .expect("a table")
    };
    assert_eq!((rows("gain").len(), rows("gain")[0].len()), (7, 3));
    let (zero_order_hold, error) = (rows("zero_order_hold"), rows("error"));
    // (A − L C) Γ = e^{(A − L C)T} − 1, here to the fourth order of T.
    let n = 7;
    let product = |a: &[Vec<f64>], b: &[Vec<f64>]| -> Vec<Vec<f64>> {
        (0..n).map(|i| (0..n).map(|j| (0..n).map(|k| a[i][k] * b[k][j]).sum()).collect()).collect()
    };
    let unit: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| f64::from(u8::from(i == j))).collect()).collect();
    let (mut power, mut sum, mut factor) = (unit.clone(), vec![vec![0.0; n]; n], 1.0);
    for k in 1..12 {
        factor *= 2e-4 / f64::from(k);
        for i in 0..n {
            (0..n).for_each(|j| sum[i][j] += factor * power[i][j]);
        }
        power = product(&power, error);
    }
    for i in 0..n {
        let size = sum.iter().map(|row| row[i].abs()).fold(0.0, f64::max);
        (0..n).for_each(|j| {
            assert!((zero_order_hold[j][i] - sum[j][i]).abs() < 1e-9 * size, "{} {}", zero_order_hold[j][i], sum[j][i])
        });
    }
    assert_eq!(rows("sensors").len(), 3);
}

/// The built-in study: the linear law's feedback follows the slope of the joint, between cos β and 1/cos β, the nonlinear one's
/// stays, and a wrong angle costs the quotient of two slopes.
#[test]
fn force_feedback_over_the_joint_angle() {
    let source = builtin("sia-joint-angle").expect("built in").source;
    assert!(study::check(source).is_empty());
    let names = ["linear-30deg", "nonlinear-30deg", "taken-for-20deg"];
    let settings = Settings { variants: names.map(String::from).to_vec(), ..runs_only() };
    let found = crate::common::project(source).run(&settings, &Silent).expect("a model without mistakes");
    let cos = |degrees: f64| degrees.to_radians().cos();
    let bounds = [(cos(30.0), 1e-3), (1.0, 1e-5), (cos(30.0) / cos(20.0), 1e-3)];
    for ((run, name), (slope, tolerance)) in found.runs.iter().zip(names).zip(bounds) {
        assert_eq!(run.outcome, Outcome::Completed);
        let first = run.series.time.partition_point(|time| *time < 2.5);
        let felt = &signal(run, "driver.tau")[first..];
        let low = felt.iter().copied().fold(f64::INFINITY, f64::min);
        let high = felt.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        assert!((low + 1.0 / slope).abs() < tolerance, "{name}: {low}");
        assert!((high + slope).abs() < tolerance, "{name}: {high}");
        assert!(run.requirements.iter().all(|one| one.passed), "{name}: {:?}", run.requirements);
        assert!(!run.requirements.is_empty());
    }
}
