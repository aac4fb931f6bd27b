//! The steering system whole, on a road: what its functions are for.

use kardan::results::{Outcome, Run};
use kardan::study::{self, Settings, Silent};

use crate::common::{runs_only, signal};

const MODEL: &str = include_str!("../../../../models/steering-on-road.toml");

fn at(run: &Run, name: &str, time: f64) -> f64 {
    let row = run.series.time.iter().position(|t| *t >= time).expect("the run goes on until then");
    signal(run, name)[row]
}

/// Every requirement of the file is met; a gust moves the car by a third at most of what it does without functions, the sine with dwell
/// ends straight on where the car spins without, what the driver feels is what is asked but for the friction of the wheel, no energy is lost.
#[test]
fn the_functions_do_what_they_are_for() {
    let study = study::run(MODEL, &runs_only(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    for run in &study.runs {
        assert_eq!(run.outcome, Outcome::Completed, "{} {:?}", run.name, run.notes);
        assert!(
            !run.requirements.is_empty() && run.requirements.iter().all(|one| one.passed),
            "{:?}",
            run.requirements
        );
        // The file asks for a relative tolerance of 1e-7 in each step.
        assert!(run.energy.residual.abs() < 1e-8 * run.energy.exchanged, "{} {:?}", run.name, run.energy);
        // The drive is what ties wheel, column and wave generator together, whatever the unit does.
        let [wg, cs, fs] = ["wg.phi", "cs.phi", "fs.phi"].map(|name| signal(run, name));
        let start = wg[0] - 51.0 * cs[0] + 50.0 * fs[0];
        assert!((0..wg.len()).all(|k| (wg[k] - 51.0 * cs[k] + 50.0 * fs[k] - start).abs() < 1e-9), "{}", run.name);
    }
    let of = |name: &str| study.runs.iter().find(|run| run.name == name).expect("a variant");
    assert!(at(of("gust"), "car.y", 3.0) < at(of("gust-plain"), "car.y", 3.0) / 3.0);
    let [assisted, plain] = ["dwell", "dwell-plain"].map(|name| at(of(name), "car.yaw_rate", 4.6));
    assert!(assisted.abs() < 0.005 && plain.abs() > 0.5, "{assisted} {plain}");
    let superposed = of("superposed");
    let wheels = signal(superposed, "car_wheel.phi").iter().fold(0.0f64, |most, x| most.max(x.abs()));
    assert!(wheels.to_degrees() > 1.9, "{wheels}");
    let felt = signal(superposed, "hands_hands.tau").iter().zip(signal(superposed, "felt"));
    assert!(felt.map(|(hands, target)| (hands + target).abs()).fold(0.0, f64::max) < 0.2);
}

/// The planetary gear ties wheel, pinion and carrier together, and whoever moves the carrier moves the rack; with its motor dead the worm holds,
/// so that from then on rack and wheel stay where that leaves them to each other. Each requirement of these variants is met.
#[test]
fn a_worm_superposes_and_is_self_locking() {
    let source = include_str!("../../../../models/afs-steering.toml");
    let run = |variant: &str, faults: &[&str]| {
        let settings = Settings {
            variants: vec![variant.into()],
            faults: faults.iter().map(|name| (*name).into()).collect(),
            ..runs_only()
        };
        let study = study::run(source, &settings, &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
        let run = study.runs[0].clone();
        assert_eq!(run.outcome, Outcome::Completed, "{variant} {:?}", run.notes);
        assert!(run.energy.residual.abs() < 1e-8 * run.energy.exchanged, "{variant} {:?}", run.energy);
        let [sun, rk, carrier] = ["sun.phi", "rk.phi", "carrier.phi"].map(|name| signal(&run, name));
        let tied = |k: usize| (5.0 * sun[k] - 6.0 * rk[k] + carrier[k]).abs();
        assert!((0..sun.len()).all(|k| tied(k) < 1e-9), "{variant}");
        run
    };
    let superposed = run("superposed", &[]);
    assert!(superposed.requirements.iter().all(|one| one.passed), "{:?}", superposed.requirements);
    // The rack goes the way that the carrier goes, a sixth of it, and the hands feel what the rack leaves over.
    assert!(at(&superposed, "carrier.phi", 2.0).abs() > 0.5 && at(&superposed, "hands_hands.tau", 2.0).abs() > 1.0);
    let dead = run("curve", &["am_motor_dead"]);
    let stood = at(&dead, "carrier.phi", 2.01);
    let after = dead.series.time.iter().zip(signal(&dead, "carrier.phi")).filter(|(time, _)| **time > 2.01);
    assert!(after.map(|(_, carrier)| (carrier - stood).abs()).fold(0.0, f64::max) < 1e-3);
}
