//! The steering on a control unit: `sia-steering-ecu` holds what is asked of it, at 1 kHz with delay, lag, limits, encoders and
//! friction. The bounds are those of the task, not what the code gave before.

mod common;

use common::{at, run, signal};
use kardan::model::builtin;
use kardan::results::{Design, Run};
use kardan::study::{self, DesignSettings, Settings, Silent, ToleranceBox};

fn source() -> &'static str {
    builtin("sia-steering-ecu").expect("built in").source
}

fn variant(source: &str, name: &str) -> Run {
    let settings = Settings { variants: vec![name.into()], ..Settings::default() };
    study::run(source, &settings, &Silent).expect("a model without mistakes").runs.remove(0)
}

fn largest(run: &Run, name: &str) -> f64 {
    signal(run, name).iter().fold(0.0, |max, x| max.max(x.abs()))
}

/// Root mean square around the mean in the last half second.
fn ripple(run: &Run, name: &str) -> f64 {
    let end = run.series.time.last().expect("rows");
    let first = run.series.time.partition_point(|time| *time < end - 0.5);
    let values = &signal(run, name)[first..];
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

#[test]
fn the_driver_feels_a_fiftieth_of_a_newton_metre_at_most_with_the_full_state() {
    let run = variant(source(), "full-state");
    assert!(largest(&run, "driver.tau") <= 0.02, "{}", largest(&run, "driver.tau"));
    assert!(largest(&run, "wg_motor.tau") <= 1.3 && largest(&run, "rk_motor.tau") <= 60.0);
    assert!((at(&run, "rk.phi", 1.5) - 0.4).abs() < 1e-4, "the rack arrives");
    // The reference model: 1 − (1 + wt) e^{−wt} of the step, w = 31 rad/s.
    let model = |time: f64| 0.4 * (1.0 - (1.0 + 31.0 * time) * (-31.0 * time).exp());
    let found = at(&run, "rk.phi", 0.2);
    assert!((found - model(0.1)).abs() < 1e-3, "{found} {}", model(0.1));
}

#[test]
fn encoders_and_friction_leave_less_than_the_friction_of_the_flexspline() {
    for name in ["rack", "rack-30deg"] {
        let run = variant(source(), name);
        for (what, bound) in [("driver.tau", 0.2), ("fs.friction", 0.2), ("wg_motor.tau", 1.3), ("rk_motor.tau", 60.0)]
        {
            assert!(largest(&run, what) <= bound, "{name} {what}: {}", largest(&run, what));
        }
        assert!(ripple(&run, "wg_motor.command") <= 0.3, "{name}: {}", ripple(&run, "wg_motor.command"));
        assert!(ripple(&run, "wg_motor.command") > 0.0, "quantisation is there");
        assert!(at(&run, "rk.phi", 1.5) > 0.36, "{name}: the rack moves");
    }
}

#[test]
fn force_feedback_is_reached() {
    for name in ["force", "force-30deg"] {
        let run = variant(source(), name);
        // 3 N m within 5 % and the friction of the flexspline.
        let felt = -at(&run, "driver.tau", 1.5);
        assert!((felt - 3.0).abs() <= 0.15 + 0.2, "{name}: {felt}");
        assert!(largest(&run, "wg_motor.tau") <= 1.3 && ripple(&run, "wg_motor.command") <= 0.3, "{name}");
    }
}

/// Any joint angle between those of the file.
#[test]
fn joint_angles_between() {
    for angle in ["10 deg", "20 deg"] {
        let text = source().replace("set = { beta = \"30 deg\"", &format!("set = {{ beta = \"{angle}\""));
        let rack = variant(&text, "rack-30deg");
        assert!(largest(&rack, "fs.friction") <= 0.2 && largest(&rack, "driver.tau") <= 0.2, "{angle}");
        let felt = -at(&variant(&text, "force-30deg"), "driver.tau", 1.5);
        assert!((felt - 3.0).abs() <= 0.35, "{angle}: {felt}");
    }
}

/// In single precision the loop does the same: what differs is less than a tenth of the interaction.
#[test]
fn single_precision_changes_less_than_a_tenth_of_the_interaction() {
    let double = variant(source(), "full-state");
    let changed = source().replace("[control.full_state]\n", "[control.full_state]\nprecision = \"single\"\n");
    assert_ne!(changed, source());
    let single = variant(&changed, "full-state");
    let interaction = largest(&double, "driver.tau");
    let both = signal(&double, "driver.tau").iter().zip(signal(&single, "driver.tau"));
    let difference = both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(difference < 0.1 * interaction, "{difference} of {interaction}");
    assert!(difference > 0.0, "it computes in single precision");
    let single = variant(source(), "rack-single");
    assert!(largest(&single, "fs.friction") <= 0.2 && ripple(&single, "wg_motor.command") <= 0.3);
}

fn design(control: &str, settings: DesignSettings) -> Design {
    let settings = DesignSettings { control: Some(control.into()), ..settings };
    study::design(source(), &settings, &Silent).expect("a design")
}

/// 1000 plants at ± 20 % of every inertia, damping and stiffness: all stable, the driver feels 0.05 N m at most.
#[test]
fn a_thousand_plants() {
    let asked = DesignSettings { tolerance: Some(ToleranceBox::Part(0.2)), ..DesignSettings::default() };
    let found = design("full_state", asked).robustness.expect("it was asked for");
    assert_eq!((found.samples, found.stable, found.parameters.len()), (1000, 1000, 12));
    assert!(found.worst_stable && found.spectral_radius.worst < 1.0);
    let felt = found.interactions.iter().find(|one| one.signal == "driver.tau").expect("it is watched");
    assert_eq!((felt.reference.as_str(), felt.step), ("ref_rk", 0.4));
    let size = &felt.size;
    assert!(size.nominal <= 0.02 && size.sampled <= 0.05 && size.worst <= 0.05, "{size:?}");
    for (motor, limit) in [("wg_motor", 1.3), ("rk_motor", 60.0)] {
        let asked = found.peaks.iter().find(|one| one.signal == motor && one.reference == "ref_rk").expect("told");
        assert!(asked.size.worst <= limit, "{motor}: {:?}", asked.size);
    }
    let order = [size.nominal, size.median, size.q90, size.q99, size.sampled, size.worst];
    assert!(order.is_sorted(), "{order:?}");
    // The worst corner is a corner.
    assert!(size.at.iter().all(|factor| (factor - 0.8).abs() < 1e-12 || (factor - 1.2).abs() < 1e-12));
}

#[test]
fn designs_beside_the_one_of_the_file() {
    let asked = DesignSettings { explore: true, ..DesignSettings::default() };
    let found = design("column", asked).exploration.expect("it was asked for");
    let own = &found.designs[0];
    assert_eq!((own.sample_time, own.delay, own.bandwidth, own.effort), (1e-3, 1e-3, 1.0, 1.0));
    assert!(own.noise > 0.0 && own.noise < 0.3 / 1.3, "{own:?}");
    assert!(found.designs.iter().any(|one| one.best));
    for one in found.designs.iter().filter(|one| one.best) {
        let beaten = |other: &&kardan::results::Alternative| {
            other.sensors == one.sensors
                && other.sample_time >= one.sample_time
                && other.bandwidth >= one.bandwidth
                && other.interaction < one.interaction
                && other.torque < one.torque
        };
        assert!(found.designs.iter().find(beaten).is_none(), "{one:?}");
    }
    // More effort, less interaction and more torque.
    let along: Vec<_> = [0.125, 1.0, 8.0]
        .iter()
        .map(|effort| {
            let alike = |one: &&kardan::results::Alternative| {
                one.effort == *effort && one.bandwidth == 1.0 && one.sample_time == 1e-3 && one.sensors == own.sensors
            };
            found.designs.iter().find(alike).expect("it is there")
        })
        .collect();
    assert!(along.windows(2).all(|pair| pair[1].interaction < pair[0].interaction && pair[1].torque > pair[0].torque));
    assert_eq!(found.sensors.len(), 3, "{:?}", found.sensors);
    assert!(!found.advice.is_empty());
    // The noise that is foretold is that of the run, where the encoders move: within a factor of three.
    let run = variant(source(), "force");
    let shown = ripple(&run, "wg_motor.command") / 1.3;
    assert!(shown < 3.0 * own.noise, "{shown} {}", own.noise);
}

/// A step eight times as large as the motors can follow: the governor holds it back, torques stay within their limits, the
/// rack arrives without overshoot, and the driver does not feel it. Without the governor the limits hold all the same, and
/// nothing winds up.
#[test]
fn a_reference_beyond_the_limits() {
    let large = source().replace("step_rack = \"0.4 rad\"", "step_rack = \"3.2 rad\"");
    let governed = variant(&large, "full-state");
    assert!(largest(&governed, "wg_motor.command") <= 1.3 + 1e-12);
    assert!(largest(&governed, "driver.tau") <= 0.02, "{}", largest(&governed, "driver.tau"));
    let end = at(&governed, "rk.phi", 1.5);
    assert!((end - 3.2).abs() < 0.01, "{end}");
    assert!(signal(&governed, "rk.phi").iter().all(|x| *x < 3.2 * 1.005));
    let free = large.replace("[control.full_state]\n", "[control.full_state]\ngovernor = \"off\"\n");
    let free = variant(&free, "full-state");
    assert!(largest(&free, "wg_motor.command") <= 1.3 + 1e-12);
    assert!((largest(&free, "wg_motor.command") - 1.3).abs() < 1e-9, "it is driven to its limit");
    let overshoot = signal(&free, "rk.phi").iter().fold(0.0f64, |max, x| max.max(*x)) / 3.2 - 1.0;
    assert!(overshoot < 0.25, "{overshoot}");
    assert!((at(&free, "rk.phi", 1.5) - 3.2).abs() < 0.1);
}

/// Hands off the wheel: nothing holds it, and it coasts; the loop says so by one free motion and is stable else.
#[test]
fn hands_off_the_wheel() {
    let off = source().replace(", \"driver_model\"]", "]");
    let off = off.split("[[scenario.event]]").next().expect("a head").to_string()
        + "[[scenario.event]]\nat = \"0.1 s\"\nsignal = \"ref_rk\"\nto = \"0.4 rad\"\n";
    let settings = DesignSettings { control: Some("full_state".into()), ..DesignSettings::default() };
    let found = study::design(&off, &settings, &Silent).expect("a design");
    let margins = found.margins.expect("told");
    assert!(margins.stable == Some(true) && margins.spectral_radius.is_some_and(|radius| radius < 1.0), "{margins:?}");
    // The rack step leaves the wheel where it is: less than 5 mrad.
    let text = off.split("[[requirement]]").next().expect("no requirements").to_string();
    let run = run(&text.replace(
        "[[variant]]                  # encoders, observer, friction\nname = \"rack\"\ncontrols = [\"column\"]",
        "[[variant]]\nname = \"rack\"\ncontrols = [\"full_state\"]",
    ));
    assert!(largest(&run, "fs.phi") < 5e-3, "{}", largest(&run, "fs.phi"));
}

/// The other two drives at 1 kHz: all requirements of their files hold, torques stay within the limits.
#[test]
fn the_other_drives() {
    for name in ["harmonic-drive-ecu", "harmonic-drive-spring-ecu"] {
        let study =
            study::run(builtin(name).expect("built in").source, &Settings::default(), &Silent).expect("no mistakes");
        assert_eq!(study.runs.len(), 4);
        for run in &study.runs {
            assert!(!run.requirements.is_empty(), "{name}: {}", run.name);
            for requirement in &run.requirements {
                assert!(requirement.passed, "{name}, {}: {} {}", run.name, requirement.text, requirement.measured);
            }
            assert!(largest(run, "wg_motor.tau") <= 1.3 && largest(run, "wg_motor.tau") > 0.05, "{name}: {}", run.name);
        }
    }
}

/// A torque that no motor can hold is told before the run; forced, the run stays within the limits.
#[test]
fn a_reference_that_can_never_be_reached() {
    let text = source().replace("step_force = \"3 N m\"", "step_force = \"90 N m\"");
    let mistakes = study::check(&text);
    let found = mistakes.iter().find(|mistake| mistake.code == "control::limit").expect("told");
    assert!(found.message.contains("rk_motor") && found.message.contains("60 N m"), "{}", found.message);
    let settings = Settings { variants: vec!["force".into()], force: true };
    let run = study::run(&text, &settings, &Silent).expect("forced").runs.remove(0);
    assert!(largest(&run, "wg_motor.command") <= 1.3 + 1e-12 && largest(&run, "rk_motor.command") <= 60.0 + 1e-12);
}
