//! Examples of Modelica's library, written anew, against the results that are published for them.

use std::collections::BTreeMap;

use kardan::results::Run;
use kardan::study::{Project, Settings, Silent};

use crate::common::{at, runs_only, signal};

/// A signal of a reference: ours is `addend + factor·signal`; the largest difference that is allowed.
struct Compared {
    reference: &'static str,
    own: &'static str,
    factor: f64,
    addend: f64,
    tolerance: f64,
}

const fn same(reference: &'static str, own: &'static str, tolerance: f64) -> Compared {
    Compared { reference, own, factor: 1.0, addend: 0.0, tolerance }
}

const fn opposite(reference: &'static str, own: &'static str, addend: f64, tolerance: f64) -> Compared {
    Compared { reference, own, factor: -1.0, addend, tolerance }
}

struct Example {
    name: &'static str,
    model: &'static str,
    results: &'static str,
    /// Tolerances are those of their integration at 1e-6, a few times over; ours is at 1e-12.
    signals: &'static [Compared],
}

macro_rules! example {
    ($name:literal, $signals:expr) => {
        Example {
            name: $name,
            model: include_str!(concat!("../golden/modelica/", $name, ".toml")),
            results: include_str!(concat!("../golden/modelica/", $name, ".csv")),
            signals: $signals,
        }
    };
}

const EXAMPLES: [Example; 12] = [
    example!(
        "First",
        &[
            opposite("damper.phi_rel", "inertia2.phi", 0.0, 2e-6),
            opposite("damper.w_rel", "inertia2.w", 0.0, 1e-4),
            same("inertia3.phi", "inertia3.phi", 1e-5),
            same("inertia3.w", "inertia3.w", 5e-4),
        ]
    ),
    example!(
        "ElasticBearing",
        &[
            same("load.phi", "load.phi", 2e-8),
            same("load.w", "load.w", 2e-7),
            same("shaft.phi", "shaft.phi", 2e-7),
            same("shaft.w", "shaft.w", 2e-6),
            same("springDamper.phi_rel", "housing.phi", 5e-9),
            same("springDamper.w_rel", "housing.w", 5e-7),
        ]
    ),
    example!("RollingWheel", &[same("inertia.phi", "wheel.phi", 2e-5), same("inertia.w", "wheel.w", 1e-5)]),
    example!(
        "Oscillator",
        &[
            opposite("damper1.s_rel", "mass2.s", 0.5, 1e-6),
            opposite("damper1.v_rel", "mass2.v", 0.0, 1e-4),
            same("mass1.s", "mass1.s", 1e-5),
            same("mass1.v", "mass1.v", 1e-3),
        ]
    ),
    example!(
        "Friction",
        &[
            same("clutch.phi_rel", "inertia2.phi - inertia3.phi", 5e-4),
            same("clutch.w_rel", "inertia2.w - inertia3.w", 5e-4),
            same("inertia3.phi", "inertia3.phi", 5e-4),
            same("inertia3.w", "inertia3.w", 5e-4),
            same("spring.phi_rel", "inertia1.phi - inertia2.phi", 5e-5),
            same("spring.w_rel", "inertia1.w - inertia2.w", 5e-4),
        ]
    ),
    example!(
        "OneWayClutch",
        &[
            same("inertiaIn.phi", "inertiaIn.phi", 1e-4),
            same("inertiaIn.w", "inertiaIn.w", 1e-4),
            same("oneWayClutch.phi_rel", "inertiaOut.phi - inertiaIn.phi", 1e-5),
            same("oneWayClutch.w_rel", "inertiaOut.w - inertiaIn.w", 5e-5),
        ]
    ),
    example!(
        "LossyGearDemo1",
        &[
            same("Inertia2.phi", "inertia2.phi", 2e-8),
            same("Inertia2.w", "inertia2.w", 1e-7),
            same("gear.mode", "sign inertia1.w", 0.0),
        ]
    ),
    example!("LossyGearDemo2", &[same("Inertia2.phi", "inertia2.phi", 2e-8), same("Inertia2.w", "inertia2.w", 1e-7),]),
    example!(
        "Backlash",
        &[
            same("elastoBacklash.phi_rel", "inertia2.phi", 5e-5),
            same("elastoBacklash.w_rel", "inertia2.w", 5e-3),
            same("springDamper.phi_rel", "inertia1.phi", 5e-5),
            same("springDamper.w_rel", "inertia1.w", 5e-3),
        ]
    ),
    example!(
        "EddyCurrentBrake",
        &[
            same("inertia.phi", "inertia.phi", 1e-4),
            same("heatCapacitor.T", "temperature", 1e-3),
            same("eddyCurrentTorque.lossPower", "loss", 1e-2),
        ]
    ),
    example!(
        "Brake",
        &[
            same("mass1.s", "mass1.s", 1e-10),
            same("mass1.v", "mass1.v", 1e-10),
            same("mass2.s", "mass1.s", 1e-10),
            same("mass2.v", "mass1.v", 1e-10),
        ]
    ),
    example!(
        "FrictionTranslational",
        &[
            same("stop1.s", "stop1.s", 2e-4),
            same("stop1.v", "stop1.v", 2e-4),
            same("stop2.s", "stop2.s", 1e-5),
            same("stop2.v", "stop2.v", 2e-4),
        ]
    ),
];

/// A signal, the difference of two, or of the brake with eddy currents what its disc takes and how warm that makes it.
fn value(run: &Run, own: &str, time: f64) -> f64 {
    match (own, own.split_once(" - ")) {
        ("temperature", _) => 293.15 + 0.5 * (400.0 - at(run, "inertia.w", time).powi(2)),
        ("loss", _) => -at(run, "brake.tau", time) * at(run, "inertia.w", time),
        _ if let Some(speed) = own.strip_prefix("sign ") => {
            let speed = at(run, speed, time);
            if speed == 0.0 { 0.0 } else { speed.signum() }
        }
        (_, Some((first, second))) => at(run, first, time) - at(run, second, time),
        (_, None) => at(run, own, time),
    }
}

fn run_of(example: &Example) -> Run {
    let settings = Settings { tolerance: Some(1e-12), ..runs_only() };
    let mut study = Project::open(example.model).run(&settings, &Silent).unwrap_or_else(|wrong| panic!("{wrong:?}"));
    study.runs.remove(0)
}

/// The rows of the table in `docs/numbers.md`, one for each signal.
#[test]
fn examples_of_modelica_are_those_of_their_library() {
    let (mut table, mut exceeding) = (String::new(), String::new());
    for example in &EXAMPLES {
        let run = run_of(example);
        let mut lines = example.results.lines();
        let names: Vec<&str> = lines.next().unwrap().split(',').collect();
        let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(|x| x.parse().unwrap()).collect()).collect();
        assert!(rows.len() >= 50, "{}", example.name);
        let columns: BTreeMap<&str, usize> = names.iter().enumerate().map(|(k, name)| (*name, k)).collect();
        assert_eq!(columns.len(), example.signals.len() + 1, "every column of {} is compared", example.name);
        for Compared { reference, own, factor, addend, tolerance } in example.signals {
            let difference =
                |row: &Vec<f64>| (row[columns[reference]] - addend - factor * value(&run, own, row[0])).abs();
            let most = rows.iter().map(difference).fold(0.0, f64::max);
            let size = rows.iter().map(|row| row[columns[reference]].abs()).fold(0.0, f64::max);
            if most > *tolerance {
                exceeding += &format!("{} {reference}: {most:e}\n", example.name);
            }
            table += &format!("| {} | `{reference}` | {size:.2e} | {most:.0e} | {tolerance:.0e} |\n", example.name);
        }
    }
    assert!(exceeding.is_empty(), "beyond their tolerance:\n{exceeding}{table}");
    let reported = include_str!("../../../../docs/numbers.md");
    assert!(reported.contains(&table), "the table in docs/numbers.md should be\n{table}");
}

/// Where both differ the error is theirs: closed forms of two examples, to which our runs are nearer by orders of magnitude.
#[test]
fn closed_forms_show_whose_the_difference_is() {
    // (J + m r²) v̇ = 10 − 10 (v/5)²: v = 5 tanh(t − 0.1).
    let wheel = run_of(&EXAMPLES[2]);
    for (t, speed) in wheel.series.time.iter().zip(signal(&wheel, "wheel.w")) {
        let exact = if *t < 0.1 { 0.0 } else { 5.0 * (t - 0.1).tanh() };
        assert!((speed - exact).abs() < 1e-10, "{t}: {speed} {exact}");
    }
    // ẍ + ω₀² x = sin ωt from rest: x = (sin ωt − (ω/ω₀) sin ω₀t)/(ω₀² − ω²).
    let masses = run_of(&EXAMPLES[3]);
    let (own, driven) = (100.0_f64, std::f64::consts::TAU * 15.9155);
    for (t, place) in masses.series.time.iter().zip(signal(&masses, "mass1.s")) {
        let exact = ((driven * t).sin() - driven / own * (own * t).sin()) / (own * own - driven * driven);
        assert!((place + 0.5 - exact).abs() < 2e-8, "{t}: {place} {exact}");
    }
}
