//! Loops that close through blocks, between laws and on torques: closed forms of their maps, and runs beside them.

use kardan::results::Design;
use kardan::study::{self, DesignSettings, Project, Settings, Silent};

use crate::common::{runs_only, signal};

fn designed(source: &str, control: &str) -> Design {
    let settings = DesignSettings { control: Some(control.into()), ..DesignSettings::default() };
    Project::open(source).design(&settings, &Silent).unwrap_or_else(|reported| panic!("{reported:?}"))
}

fn radius(design: &Design) -> f64 {
    design.margins.as_ref().and_then(|margins| margins.spectral_radius).expect("a map")
}

/// A disc without friction, 2 kg m²; a program at 1 ms.
const DISC: &str = r#"
[shaft.disc]
inertia = "2 kg m^2"

[motor.drive]
shaft = "disc"

[control.unit]
law = "program"
commands = { drive = "COMMAND" }
sample_time = "1 ms"

[scenario]
duration = "1 s"
output_step = "1 ms"
initial = { "disc.w" = "1 rad/s" }
"#;

/// The program reads what a block finds every 2 ms, the faster one as it was before that instant: over 2 ms the torque is that of the speed
/// 2 ms ago for one sample and that of now for the next, `λ² − (1 − c) λ + c = 0` with `c = K T / J = 0.4`; stable up to c = 1.
#[test]
fn a_program_behind_a_slower_block() {
    let source = DISC.replace("COMMAND", "-800 N m s/rad * held")
        + "[block.seen]\nkind = \"gain\"\ninput = \"disc.w\"\ngain = 1\nsample_time = \"2 ms\"\n\
           [block.held]\nkind = \"hold\"\ninput = \"seen\"\nsample_time = \"1 ms\"\n";
    let design = designed(&source, "unit");
    assert!((radius(&design) - 0.4f64.powf(0.25)).abs() < 1e-9, "{}", radius(&design));
    let [_, up] = design.margins.as_ref().and_then(|margins| margins.gain_margin.clone()).expect("margins");
    assert!((up.value - 2.5).abs() < 1e-9, "{}", up.value);
    assert!(design.warnings.iter().all(|warning| !warning.contains("seen")), "{:?}", design.warnings);
    assert!(design.notes.iter().any(|note| note.contains("`seen`")), "{:?}", design.notes);
}

/// A torque that a block gives, beside a program: `ω → (1 − (K + k) T / J) ω`.
#[test]
fn a_torque_that_follows_from_a_block() {
    // All factors of a law take the same side of where the block answers zero.
    for law in ["push", "sign(push) * abs(push)", "if(push > 0 N m, 1, -1) * abs(push)"] {
        let source = DISC.replace("COMMAND", "-200 N m s/rad * disc.w")
            + "[block.push]\nkind = \"gain\"\ninput = \"disc.w\"\ngain = \"-500 N m s/rad\"\nsample_time = \"1 ms\"\n\
               [torque.pushed]\nshaft = \"disc\"\nlaw = \"LAW\"\n";
        let found = radius(&designed(&source.replace("LAW", law), "unit"));
        assert!((found - 0.65).abs() < 1e-9, "{law}: {found}");
    }
}

/// A damping that a block switches on, which is on at rest: `ω → (a − (1 − a) K / d) ω` with `a = exp(−d T / J)`.
#[test]
fn a_damping_that_a_block_switches() {
    let source = DISC.replace("COMMAND", "-200 N m s/rad * disc.w")
        + "[block.on]\nkind = \"gain\"\ninput = \"if(disc.w > 100 rad/s, 0, 1)\"\ngain = 1\nsample_time = \"1 ms\"\n\
           [torque.drag]\nshaft = \"disc\"\nlaw = \"-on * 300 N m s/rad * disc.w\"\n";
    let found = radius(&designed(&source, "unit"));
    let a = (-0.15f64).exp();
    assert!((found - (a - (1.0 - a) * 200.0 / 300.0)).abs() < 1e-9, "{found}");
}

/// What a law estimates, behind a filter with a sample time of its own, drives a second motor: the factor at which the map says that the loop is
/// just unstable is the one at which a run begins to grow.
#[test]
fn a_run_grows_where_the_map_says() {
    let source = |gain: f64| {
        format!(
            r#"
[shaft.arm]
inertia = "0.5 kg m^2"
damping = "0.1 N m s/rad"

[motor.drive]
shaft = "arm"

[motor.second]
shaft = "arm"
lag = "2 ms"

[sensor.encoder]
measures = "angle"
shaft = "arm"

[control.unit]
law = "pole_placement"
inputs = ["drive"]
poles = [-8, -9]
sample_time = "1 ms"
delay = "1 ms"

[control.unit.observer]
sensors = ["encoder.phi"]
disturbances = ["arm"]
poles = [-40, -41, -42]

[block.late]
kind = "low_pass"
input = "unit.arm.phi"
time_constant = "10 ms"
sample_time = "2 ms"

[block.held]
kind = "hold"
input = "late"
sample_time = "1 ms"

[control.more]
law = "program"
commands = {{ second = "-{gain} N m/rad * held" }}
sample_time = "1 ms"
delay = "0.4 ms"

[scenario]
duration = "20 s"
output_step = "5 ms"
initial = {{ "arm.phi" = "0.01 rad" }}
"#
        )
    };
    let design = designed(&source(100.0), "more");
    let margins = design.margins.expect("margins");
    assert_eq!(margins.stable, Some(true));
    let [_, up] = margins.gain_margin.expect("margins");
    let largest = |factor: f64| {
        let settings = Settings { force: true, ..runs_only() };
        let study = study::run(&source(100.0 * factor * up.value), &settings, &Silent).expect("a run");
        let phi = signal(&study.runs[0], "arm.phi");
        let most = |part: &[f64]| part.iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let n = phi.len();
        most(&phi[3 * n / 4..]) / most(&phi[n / 2..3 * n / 4])
    };
    let (below, above) = (largest(0.99), largest(1.01));
    assert!(up.value > 1.0 && below < 0.99 && above > 1.01, "{} {below} {above}", up.value);
}
