//! The steering system whole, on a road: what its functions are for.

use kardan::results::{Outcome, Run};
use kardan::study::{self, Silent};

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
    let study = study::run(MODEL, &runs_only(), &Silent).unwrap_or_else(|told| panic!("{told:?}"));
    for run in &study.runs {
        assert_eq!(run.outcome, Outcome::Completed, "{} {:?}", run.name, run.notes);
        assert!(
            !run.requirements.is_empty() && run.requirements.iter().all(|one| one.passed),
            "{:?}",
            run.requirements
        );
        // The file asks for a relative tolerance of 1e-6 in each step.
        assert!(run.energy.residual.abs() < 1e-8 * run.energy.exchanged, "{} {:?}", run.name, run.energy);
        // The drive is what ties wheel, column and wave generator together, whatever the unit does.
        let [wg, cs, fs] = ["wg.phi", "cs.phi", "fs.phi"].map(|name| signal(run, name));
        let start = wg[0] - 51.0 * cs[0] + 50.0 * fs[0];
        assert!((0..wg.len()).all(|k| (wg[k] - 51.0 * cs[k] + 50.0 * fs[k] - start).abs() < 1e-9), "{}", run.name);
    }
    let of = |name: &str| study.runs.iter().find(|run| run.name == name).expect("a variant");
    assert!(at(of("gust"), "car.y", 3.0) < at(of("gust-plain"), "car.y", 3.0) / 3.0);
    let [with, without] = ["dwell", "dwell-plain"].map(|name| at(of(name), "car.yaw_rate", 4.6));
    assert!(with.abs() < 0.005 && without.abs() > 0.5, "{with} {without}");
    let superposed = of("superposed");
    let wheels = signal(superposed, "car_wheel.phi").iter().fold(0.0f64, |most, x| most.max(x.abs()));
    assert!(wheels.to_degrees() > 1.9, "{wheels}");
    let felt = signal(superposed, "hands_hands.tau").iter().zip(signal(superposed, "felt"));
    assert!(felt.map(|(hands, asked)| (hands + asked).abs()).fold(0.0, f64::max) < 0.2);
}
