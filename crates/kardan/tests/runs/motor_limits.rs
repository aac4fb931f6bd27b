//! Motors at their limits are never silent: how long, since when, and what the design says of it.

use kardan::model;
use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, DesignSettings, Settings, Silent};

fn run_of(source: &str) -> Run {
    let mut study = study::run(source, &Settings::default(), &Silent).unwrap_or_else(|why| panic!("{why:?}"));
    assert_eq!(study.runs.len(), 1);
    study.runs.remove(0)
}

/// A motor of 2 N m that is asked for 5 N m from 1 s to 2 s, and for a ramp to 4 N m from 3 s to 5 s, held to the end.
const LIMITED_MOTOR: &str = r#"
[shaft.a]
inertia = "1 kg m^2"
damping = "1 N m s/rad"

[motor.m]
shaft = "a"
torque_limit = "2 N m"

[scenario]
duration = "6 s"

[[scenario.event]]
at = "1 s"
signal = "m.tau"
to = "5 N m"

[[scenario.event]]
at = "2 s"
signal = "m.tau"
to = "0 N m"

[[scenario.event]]
at = "3 s"
signal = "m.tau"
to = "4 N m"
over = "2 s"

[[requirement]]
signal = "m.tau"
measure = "time_at_limit"
below = "3.0001 s"

[[requirement]]
signal = "m.tau"
measure = "time_at_limit"
from = "1.5 s"
until = "4.5 s"
below = "1 s"

[[requirement]]
signal = "m.tau"
measure = "rms"
from = "3 s"
until = "4 s"
below = "2 N m"

[[requirement]]
signal = "m.tau"
measure = "ripple"
from = "3 s"
until = "4 s"
below = "2 N m"
"#;

/// Of a ramp from 0 to 2 N m the root of the mean square is 2/√3, around the mean of 1 N m it is 1/√3.
#[test]
fn means_are_those_over_the_time() {
    let run = run_of(LIMITED_MOTOR);
    let [.., rms, ripple] = &run.requirements[..] else { panic!("{:?}", run.requirements) };
    assert_eq!(rms.text, "rms m.tau from 3 s to 4 s < 2 N m");
    for (found, expected) in [(rms, 2.0 / 3f64.sqrt()), (ripple, 1.0 / 3f64.sqrt())] {
        // Between rows of some milliseconds the squares are taken as straight lines.
        assert!((found.measured.unwrap() - expected).abs() < 1e-4 && found.passed, "{found:?}");
    }
}

#[test]
fn time_at_a_limit_is_that_of_the_command() {
    let run = run_of(LIMITED_MOTOR);
    assert_eq!(run.outcome, Outcome::Completed);
    let motor_load = &run.motor_loads[0];
    assert_eq!(motor_load.motor, "m");
    assert_eq!(motor_load.controller, None);
    assert_eq!(motor_load.demand, 5.0);
    // The ramp passes 2 N m at 4 s; its crossing is located to the rounding of the dense output.
    let expected = [(1.0, 2.0), (4.0, 6.0)];
    assert_eq!(motor_load.at_torque_limit.len(), 2, "{:?}", motor_load.at_torque_limit);
    for (found, expected) in motor_load.at_torque_limit.iter().zip(expected) {
        assert!((found.start - expected.0).abs() < 1e-9 && (found.end - expected.1).abs() < 1e-9, "{found:?}");
    }
    let [whole, window, ..] = &run.requirements[..] else { panic!("{:?}", run.requirements) };
    assert!(whole.passed && (whole.measured.unwrap() - 3.0).abs() < 1e-9 && whole.unit == "s", "{whole:?}");
    assert_eq!(whole.text, "time of m at its torque limit < 3.0001 s");
    // From 1.5 s to 2 s and from 4 s to 4.5 s: 1 s, to rounding of the crossing.
    assert!((window.measured.unwrap() - 1.0).abs() < 1e-9, "{window:?}");
    let note = run.notes.iter().find(|note| note.contains("torque limit")).expect("a note");
    assert!(
        note.starts_with("m is at its torque limit of 2 N m for 3 s of 6 s, first at 1 s; its command reaches 5 N m"),
        "{note}"
    );
}

/// A motor of 1 N m that nobody controls is asked for 2 N m sin t: it is at its limit from t = π/6 to 5π/6.
#[test]
fn a_command_that_is_a_function_of_time_reaches_the_limit() {
    let (head, _) = LIMITED_MOTOR.split_once("[scenario]").expect("a scenario");
    let head = head.replace("torque_limit = \"2 N m\"", "torque_limit = \"1 N m\"");
    let source =
        format!("{head}[scenario]\nduration = \"3 s\"\nsignals = {{ \"m.tau\" = \"2 N m * sin(t / (1 s))\" }}\n");
    for method in [Method::Taylor, Method::Dop853] {
        let settings = Settings { method, ..Settings::default() };
        let run = study::run(&source, &settings, &Silent).unwrap_or_else(|why| panic!("{why:?}")).runs.remove(0);
        let [at] = &run.motor_loads[0].at_torque_limit[..] else { panic!("{:?}", run.motor_loads) };
        let sixth = std::f64::consts::FRAC_PI_6;
        assert!((at.start - sixth).abs() < 1e-9 && (at.end - 5.0 * sixth).abs() < 1e-9, "{at:?}");
        let largest = run.series.signal("m.tau").unwrap().values.iter().fold(0.0f64, |most, x| most.max(*x));
        assert!((largest - 1.0).abs() < 1e-12, "{largest}");
    }
}

#[test]
fn a_rate_limit_is_reported_too() {
    let source = LIMITED_MOTOR.replace("torque_limit = \"2 N m\"", "rate_limit = \"10 N m/s\"");
    let source = &source[..source.find("[[requirement]]").unwrap()];
    let run = run_of(source);
    // 5 N m take 0.5 s up and 0.5 s down; the ramp of 2 N m/s is slower.
    let motor_load = &run.motor_loads[0];
    assert!((motor_load.seconds_at_rate_limit(0.0, 6.0) - 1.0).abs() < 1e-6, "{:?}", motor_load.at_rate_limit);
    assert!(motor_load.at_torque_limit.is_empty());
    assert!(run.notes.iter().any(|note| note.contains("moves at its rate limit of 10 N m/s")), "{:?}", run.notes);
}

/// The steering in continuous time, whose motor of the wave generator gets the limit of a real one.
fn limited_steering(limit: &str) -> String {
    let source = model::builtin("sia-steering").unwrap().source;
    let head = "[motor.wg_motor]";
    assert!(source.contains(head));
    let source = source.replacen(head, &format!("{head}\ntorque_limit = \"{limit}\""), 1);
    // One joint angle is enough.
    let at = source.find("[variants]").expect("the built-in model has variants");
    let line = source[at..].find("beta").unwrap() + at;
    let end = source[line..].find('\n').unwrap() + line;
    format!("{}beta = \"[0] deg\"{}", &source[..line], &source[end..])
}

#[test]
fn a_design_whose_motors_saturate_in_the_scenario_says_so() {
    let source = limited_steering("1.3 N m");
    let settings = DesignSettings { simulate: true, ..DesignSettings::default() };
    let design = study::design(&source, &settings, &Silent).unwrap();
    let motor_load =
        design.motor_loads.iter().find(|found| found.motor_load.motor == "wg_motor").expect("the motor is watched");
    assert!(motor_load.motor_load.demand > 1.3, "{motor_load:?}");
    assert!(motor_load.motor_load.at_limit());
    assert!(
        design.warnings.iter().any(|text| text.contains("in the scenario of the file") && text.contains("wg_motor"))
    );
    let verdict = design.verdict().text;
    assert!(verdict.contains("the scenario drives its motors to their limits"), "{verdict}");
    // The run of the same file: a note, and the same times.
    let run = run_of(&source);
    let own = run.motor_loads.iter().find(|found| found.motor == "wg_motor").unwrap();
    assert_eq!(own.at_torque_limit, motor_load.motor_load.at_torque_limit);
    assert!(
        run.notes.iter().any(
            |note| note.contains("wg_motor is at its torque limit") && note.contains("does not behave as designed")
        )
    );
}

#[test]
fn a_motor_below_its_limits_gives_no_warning() {
    let source = limited_steering("1000 N m");
    let settings = DesignSettings { simulate: true, ..DesignSettings::default() };
    let design = study::design(&source, &settings, &Silent).unwrap();
    let motor_load = design.motor_loads.iter().find(|found| found.motor_load.motor == "wg_motor").unwrap();
    assert!(!motor_load.motor_load.at_limit() && motor_load.motor_load.demand < 1000.0, "{motor_load:?}");
    assert!(!design.warnings.iter().any(|text| text.contains("in the scenario of the file")));
    let verdict = design.verdict().text;
    assert!(!verdict.contains("limits"), "{verdict}");
}
