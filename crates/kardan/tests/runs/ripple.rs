//! Motors whose torque has a ripple: a pendulum in disguise.

use crate::common::{run, signal};

/// `J φ̈ = T + r sin(n φ)`: `½ J φ̇² = T φ + (r/n)(1 − cos n φ)` from rest at zero, in every row; the drive reports T.
#[test]
fn ripple_does_the_work_of_its_potential() {
    let run = run(r#"
        [shaft.a]
        inertia = "0.01 kg m^2"
        [motor.m]
        shaft = "a"
        ripple = "0.05 N m"
        ripple_order = 12
        [scenario]
        duration = "2 s"
        [[scenario.event]]
        at = "0 s"
        signal = "m.tau"
        to = "0.02 N m"
    "#);
    let (angle, speed) = (signal(&run, "a.phi"), signal(&run, "a.w"));
    for k in 0..angle.len() {
        let kinetic = 0.5 * 0.01 * speed[k] * speed[k];
        let work = 0.02 * angle[k] + 0.05 / 12.0 * (1.0 - (12.0 * angle[k]).cos());
        assert!((kinetic - work).abs() < 1e-10, "{kinetic} against {work}");
        assert_eq!(signal(&run, "m.tau")[k], 0.02);
        assert!((signal(&run, "m.ripple")[k] - 0.05 * (12.0 * angle[k]).sin()).abs() < 1e-16);
    }
    assert!(angle.last().is_some_and(|angle| *angle > 3.0));
    assert!(run.energy.residual.abs() < 1e-9 * run.energy.input);
}

/// Between two shafts the angle is that between them, and both feel the ripple: the sum of their momenta stays zero. No ripple is
/// plain, to the last bit.
#[test]
fn ripple_acts_on_both_ends() {
    let model = |keys: &str| {
        format!(
            "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.02 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
             reaction = \"b\"\n{keys}\n[scenario]\nduration = \"1 s\"\n[[scenario.event]]\nat = \"0.1 s\"\n\
             signal = \"m.tau\"\nto = \"0.1 N m\"\n"
        )
    };
    let rippled = run(&model("ripple = \"0.02 N m\"\nripple_order = 7"));
    let (a, b) = (signal(&rippled, "a.w"), signal(&rippled, "b.w"));
    assert!(a.iter().zip(b).all(|(a, b)| (0.01 * a + 0.02 * b).abs() < 1e-11));
    let ripple = signal(&rippled, "m.ripple");
    let twist = signal(&rippled, "a.phi").iter().zip(signal(&rippled, "b.phi")).map(|(a, b)| a - b);
    assert!(ripple.iter().zip(twist).all(|(ripple, x)| (ripple - 0.02 * (7.0 * x).sin()).abs() < 1e-16));
    assert!(ripple.iter().any(|ripple| ripple.abs() > 0.019));
    let (none, plain) = (run(&model("ripple = \"0 N m\"\nripple_order = 7")), run(&model("")));
    assert_eq!(none.series, plain.series);
}
