//! A harmonic drive whose flexspline is a spring: the same row as a rigid one, no coordinate more than that it gives back.

use crate::common::{first, run, signal};
use kardan::analysis::OutputSignal;
use kardan::equations::Measured;
use kardan::num::{Rational, Scalar};
use kardan::results::Run;
use kardan::synthesis::Plant;

/// The drive of the source; `keys` go to the harmonic drive, `more` to the end.
fn drive(keys: &str, more: &str) -> String {
    format!(
        r#"
        [shaft.wg]
        inertia = "130 kg mm^2"
        damping = "0.0006 N m s/rad"
        [shaft.cs]
        inertia = "10250.34 kg mm^2"
        damping = "0.01 N m s/rad"
        [shaft.fs]
        inertia = "10297.41 kg mm^2"
        damping = "0.02 N m s/rad"
        [harmonic_drive.hd]
        wave_generator = "wg"
        circular_spline = "cs"
        flexspline = "fs"
        ratio = 50
        {keys}
        [motor.wg_motor]
        shaft = "wg"
        [motor.cs_motor]
        shaft = "cs"
        [sensor.fs_torque]
        measures = "torque"
        element = "hd"
        shaft = "fs"
        {more}
        "#
    )
}

const RAMPS: &str = r#"
    [scenario]
    duration = "0.5 s"
    [[scenario.event]]
    at = "0.1 s"
    signal = "wg_motor.tau"
    to = "0.05 N m"
    over = "0.2 s"
    [[scenario.event]]
    at = "0.1 s"
    signal = "cs_motor.tau"
    to = "-1 N m"
    over = "0.1 s"
"#;

/// What is felt at the flexspline with the other two held is the stiffness itself, along the direction of the gear, exactly;
/// a spring under the name of the key.
#[test]
fn stiffness_is_that_of_the_flexspline() {
    let keys = "stiffness = \"8000 N m/rad\"\ndamping = \"0.3 N m s/rad\"\noffset = \"0.1 rad\"";
    let equations = first(&drive(keys, "")).reduced.equations.clone();
    let number = |name: &str| equations.coordinates.iter().position(|shaft| shaft == name).unwrap();
    let gear = [("cs", -51), ("fs", 50), ("wg", 1)];
    let square = Rational::from(50 * 50);
    let shaft_damping =
        [("cs", Rational::from(1) / Rational::from(100)), ("fs", Rational::from(1) / Rational::from(50))];
    for (one, x) in gear {
        for (other, y) in gear {
            let share = Rational::from(x * y) / &square;
            let at = (number(one), number(other));
            assert_eq!(equations.stiffness_matrix()[at], Rational::from(8000) * &share);
            let own = shaft_damping.iter().find(|(name, _)| one == other && *name == one);
            let mut own = own.map_or(Rational::ZERO, |(_, own)| own.clone());
            if one == other && one == "wg" {
                own = Rational::from(6) / Rational::from(10_000);
            }
            assert_eq!(equations.damping_matrix()[at], own + Rational::from(3) / Rational::from(10) * share);
        }
    }
    assert_eq!(equations.constraints.len(), 0);
    let coefficient = equations.coefficients().into_iter().find(|one| one.name == "hd.stiffness").unwrap();
    assert_eq!(coefficient.value, 8000.0);
}

/// Difference of a signal of two runs after the ramps and what they leave, relative to its size.
fn away(run: &Run, other: &Run, name: &str) -> f64 {
    let late = |of: &Run| -> Vec<f64> {
        let both = of.series.time.iter().zip(signal(of, name));
        both.filter(|(t, _)| **t > 0.35).map(|(_, x)| *x).collect()
    };
    let (ours, theirs) = (late(run), late(other));
    let norm = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>().sqrt();
    assert_eq!(ours.len(), theirs.len());
    norm(&ours.iter().zip(&theirs).map(|(a, b)| a - b).collect::<Vec<_>>()) / norm(&theirs)
}

/// Motion and torque come closer to those of the rigid drive as 1/stiffness, with the sign of the constraint torque. A spring on the
/// flexspline keeps the drive swinging at about 10 rad/s; twists of their own die out (damping ratio 1 at about 0.005 kg m² along
/// the twist, time constants below 1 ms).
#[test]
fn a_stiff_drive_is_rigid() {
    let more = format!("[spring_damper.load]\nshaft_1 = \"fs\"\nstiffness = \"5 N m/rad\"\n{RAMPS}");
    let rigid = run(&drive("", &more));
    let mut before: Option<Vec<f64>> = None;
    for stiffness in [1e4, 1e5, 1e6] {
        let damping = 2.0 * (0.005f64 * stiffness).sqrt();
        let keys = format!("stiffness = \"{stiffness} N m/rad\"\ndamping = \"{damping} N m s/rad\"");
        let soft = run(&drive(&keys, &more));
        let e = soft.energy;
        assert!(e.residual.abs() < 1e-8 * e.input, "{e:?}");
        let names = ["hd.tau", "hd.fs.tau", "hd.cs.tau", "fs_torque.tau", "wg.phi", "cs.w", "fs.phi"];
        let now: Vec<f64> = names.iter().map(|name| away(&soft, &rigid, name)).collect();
        for ((name, now), before) in names.iter().zip(&now).zip(before.into_iter().flatten()) {
            // Beside 1/s there is d/s at 10 rad/s, 1/100 at the softest, and what 1e-10 per step leaves.
            assert!((before / now / 10.0 - 1.0).abs() < 0.1, "{name}: {before:e} to {now:e} at {stiffness}");
        }
        assert!(now.iter().all(|away| *away < 100.0 / stiffness), "{now:?} at {stiffness}");
        before = Some(now);
    }
}

/// In every row: on the shafts 1, −51 and 50 times the torque, which is that of the twist, and the reading is the column.
#[test]
fn the_torque_is_that_of_the_twist() {
    let keys = "stiffness = \"5000 N m/rad\"\ndamping = \"2 N m s/rad\"\noffset = \"0.02 rad\"";
    let soft = run(&drive(keys, RAMPS));
    let column = |name: &str| signal(&soft, name);
    for k in 0..soft.series.time.len() {
        let direction = |what: &str, offset: f64| {
            let of = |shaft: &str| column(&format!("{shaft}.{what}"))[k];
            (of("wg") - 51.0 * of("cs") + 50.0 * of("fs") + offset) / 50.0
        };
        let expected = -(5000.0 * direction("phi", 0.02) + 2.0 * direction("w", 0.0)) / 50.0;
        let torque = column("hd.tau")[k];
        // Angles up to 100 rad, rounded, times 5000/50 over 50.
        assert!((torque - expected).abs() < 1e-11, "{torque} against {expected}");
        assert!((column("hd.fs.tau")[k] - 50.0 * torque).abs() < 1e-12);
        assert!((column("hd.cs.tau")[k] + 51.0 * torque).abs() < 1e-12);
        assert!((column("hd.wg.tau")[k] - torque).abs() < 1e-13);
        assert_eq!(column("fs_torque.tau")[k], column("hd.fs.tau")[k]);
    }
}

/// The row of the linear model is that of the run: exact `−(s aᵀq + d aᵀq̇) a_fs`.
#[test]
fn the_linear_output_is_the_torque() {
    let variant = first(&drive("stiffness = \"5000 N m/rad\"\ndamping = \"2 N m s/rad\"", ""));
    let plant = Plant::new(variant.reduced.clone(), vec![0.0; 3]);
    let output = plant.output("fs_torque").unwrap();
    assert_eq!(output.measured, Measured::ComplianceTorque("hd".into(), "fs".into()));
    let system = plant.system(&[], &[OutputSignal { name: output.name, measured: output.measured }]);
    for (k, (name, x)) in [("cs", 51), ("fs", -50), ("wg", -1)].into_iter().enumerate() {
        assert_eq!(system.states[k], format!("{name}.phi"));
        assert_eq!(system.c[(0, k)], Rational::from(100 * x));
        assert_eq!(system.c[(0, 3 + k)], Rational::from(2 * x).over(&Rational::from(50)));
    }
}
