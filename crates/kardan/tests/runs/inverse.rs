//! Inverse dynamics: motions that are prescribed as a whole, so that nothing is free.

use kardan::results::Outcome;
use kardan::simulate::Method;
use kardan::study::{AnalyzeSettings, DesignSettings, Project, Silent};

use crate::common::{run, run_by, runs_only, signal};

/// A gear of ratio 2 between 0.1 and 1 kg m² with a damper, whose only motion is prescribed, and more keys.
fn all_prescribed(motion: &str, more: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"0.1 kg m^2\"\ndamping = \"0.2 N m s/rad\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
         [prescribed_motion.pm]\nshaft = \"a\"\n{motion}\n[scenario]\nduration = \"2 s\"\noutput_step = \"10 ms\"\n\
         [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 2\n{more}"
    )
}

/// Inverse dynamics: with `φ = sin ωt` nothing is free, and the torque that it takes is `(J_a + J_b / 4) φ″ + d φ′`, exactly from an angle, to the tolerance
/// from a speed or an acceleration.
#[test]
fn the_only_motion_may_be_prescribed() {
    let w = 2.0 * std::f64::consts::PI;
    let motions = [
        ("angle = \"1 rad * sin(2 pi t / 1 s)\"", "", 1e-12),
        ("speed = \"2 pi * 1 rad/s * cos(2 pi t / 1 s)\"", "", 1e-8),
        (
            "acceleration = \"-4 * pi^2 * 1 rad/s^2 * sin(2 pi t / 1 s)\"",
            "initial = { \"a.w\" = \"2 pi rad/s\" }\n",
            1e-8,
        ),
    ];
    for (motion, initial, tolerance) in motions {
        let model = all_prescribed(motion, "").replace("[gear.g]", &format!("{initial}[gear.g]"));
        for method in [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic] {
            let run = run_by(&model, method, None);
            assert_eq!(run.outcome, Outcome::Completed, "{motion} {method:?}");
            for (time, torque) in run.series.time.iter().zip(signal(&run, "pm.tau")) {
                let expected = -(0.1 + 0.25) * w * w * (w * time).sin() + 0.2 * w * (w * time).cos();
                assert!(
                    (torque - expected).abs() < tolerance * 14.0,
                    "{motion} {method:?} {time}: {torque} {expected}"
                );
            }
            assert!(
                run.energy.residual_share().is_some_and(|part| part < 1e-9),
                "{motion} {method:?} {:?}",
                run.energy
            );
        }
    }
}

/// What rubs, presses and drives beside it is in the torque and in the balance of energy; what would hold against it is told with both names.
#[test]
fn a_motion_that_is_all_prescribed_meets_losses_and_stops() {
    let more = "efficiency = 0.8\nefficiency_back = 0.5\n[motor.m]\nshaft = \"b\"\n\
                [end_stop.st]\nshaft_1 = \"b\"\nshaft_2 = \"ground\"\nlower = \"-10 rad\"\nupper = \"0.4 rad\"\nstiffness = \"100 N m/rad\"\n";
    let model = all_prescribed("angle = \"1 rad * sin(2 pi t / 1 s)\"", more)
        .replace("damping", "friction = \"0.3 N m\"\ndamping");
    let found = run(&model);
    assert!(found.energy.residual_share().is_some_and(|part| part < 1e-9), "{:?}", found.energy);
    assert!(found.energy.dissipated > 20.0 && found.warnings.is_empty(), "{:?}", found.energy);
    let locked = model + "[lock.l]\nshaft_1 = \"b\"\nshaft_2 = \"ground\"\nengaged = \"if(t > 1.1 s, 1, 0)\"\n";
    let study = Project::open(&locked).run(&runs_only(), &Silent).expect("it is a model");
    let Outcome::Failed { time, cause } = &study.runs[0].outcome else { panic!("it is locked") };
    assert!((time - 1.1).abs() < 1e-9, "{time}");
    assert!(cause.contains("`l` constrains a motion that `pm` prescribes, and contradicts it"), "{cause}");
    assert!(study.runs[0].warnings.is_empty(), "{:?}", study.runs[0].warnings);
}

/// Analyses and designs say that nothing is free; controllers are refused where the model is checked.
#[test]
fn where_all_is_prescribed_nothing_is_analysed() {
    for motion in ["angle = \"1 rad * sin(2 pi t / 1 s)\"", "speed = \"1 rad/s * cos(2 pi t / 1 s)\""] {
        let model = all_prescribed(motion, "[motor.m]\nshaft = \"b\"\n");
        let message = "no free motion remains: `pm` prescribes all motion";
        let project = Project::open(&model);
        assert!(project.diagnostics().is_empty(), "{:?}", project.diagnostics());
        let found = project.analyze(&AnalyzeSettings::default(), &Silent).expect_err("no free motion");
        assert_eq!(found[0].message, message);
        let found = project.design(&DesignSettings::default(), &Silent).expect_err("no free motion");
        assert_eq!(found[0].message, message);
        let controlled =
            model + "[control.c]\nlaw = \"pole_placement\"\ninputs = [\"m\"]\npoles = [\"-1 1/s\", \"-2 1/s\"]\n";
        let project = Project::open(&controlled);
        assert!(
            project.diagnostics().iter().any(|diagnostic| diagnostic.message == message),
            "{:?}",
            project.diagnostics()
        );
    }
}

/// A curve is followed from its driving end alone: a rack is kept where its position, or its speed, is prescribed. With `s = γ(φ)` and
/// `F = m s″ + J φ″ / γ′` the work of the force over a period is nothing.
#[test]
fn a_rack_with_a_curve_is_prescribed_by_its_position_or_its_speed() {
    let rack = |motion: &str| {
        format!(
            "[shaft.p]\ninertia = \"0.1 kg m^2\"\n[mass.rack]\nmass = \"2 kg\"\n[rack_and_pinion.rp]\npinion = \"p\"\nrack = \"rack\"\n\
             curve = [ {{ angle = \"-90 deg\", position = \"-20 mm\" }}, {{ angle = \"0 deg\", position = \"0 mm\" }}, \
             {{ angle = \"90 deg\", position = \"25 mm\" }} ]\n[prescribed_motion.pm]\nmass = \"rack\"\n{motion}\n[scenario]\nduration = \"1 s\"\n"
        )
    };
    for motion in ["position = \"10 mm * sin(2 pi t / 1 s)\"", "speed = \"10 mm * 2 pi / 1 s * cos(2 pi t / 1 s)\""] {
        let run = run(&rack(motion));
        assert_eq!(run.outcome, Outcome::Completed);
        let mut positions = run.series.time.iter().zip(signal(&run, "rack.s"));
        assert!(positions.all(|(t, s)| (s - 0.01 * (2.0 * std::f64::consts::PI * t).sin()).abs() < 1e-10));
        assert!(run.energy.input.abs() < 1e-8 && run.energy.exchanged > 1.0, "{:?}", run.energy);
    }
}
