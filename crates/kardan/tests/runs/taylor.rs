//! Taylor series against the reference method: the same motion and the same events, on every model that comes with kardan.

use kardan::results::{Outcome, Physical, Run};
use kardan::simulate::Method;
use kardan::study::{Settings, Silent};

use super::common::{project, runs_only};

pub fn runs(source: &str, method: Method, tolerance: f64, variants: &[&str]) -> Vec<Run> {
    let variants = variants.iter().map(ToString::to_string).collect();
    let settings = Settings { method, tolerance: Some(tolerance), variants, ..runs_only() };
    let study = project(source).run(&settings, &Silent);
    study.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}\n{source}")).runs
}

pub fn builtin(name: &str) -> &'static str {
    kardan::model::builtin(name).unwrap().source
}

/// Largest difference of signals of a kind, in parts of the largest value of that kind, between events.
pub fn difference(one: &Run, other: &Run, physical: Physical) -> f64 {
    let same_kind = || one.series.signals.iter().filter(|signal| signal.physical == physical);
    let size = same_kind().flat_map(|signal| &signal.values).fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let near_event = |time: f64| one.events.iter().any(|event| (event.time - time).abs() < 1e-6);
    let mut worst = 0.0_f64;
    for signal in same_kind() {
        let counterpart = other.series.signal(&signal.name).unwrap();
        for ((a, b), time) in signal.values.iter().zip(&counterpart.values).zip(&one.series.time) {
            if !near_event(*time) {
                worst = worst.max((a - b).abs() / size);
            }
        }
    }
    worst
}

/// The angles and speeds of both methods at 1e-9 differ from the reference at 1e-12 by what that tolerance allows; the events are the same.
#[test]
fn the_same_motion_and_the_same_events() {
    // Where the loop is sampled, or amplifies rounding, the reference itself is known to less than 1e-11.
    for (model, variant) in [
        ("sia-steering", "beta-30deg"),
        ("sia-steering", "beta-0deg"),
        ("harmonic-drive", "torque"),
        ("two-bodies", ""),
        ("rlc-ladder", ""),
    ] {
        let variants: Vec<&str> = Some(variant).filter(|name| !name.is_empty()).into_iter().collect();
        let reference = runs(builtin(model), Method::Dop853, 1e-12, &variants);
        let series = runs(builtin(model), Method::Taylor, 1e-9, &variants);
        for (one, other) in reference.iter().zip(&series) {
            let what = format!("{model} {}", one.name);
            assert_eq!((&one.outcome, &other.outcome), (&Outcome::Completed, &Outcome::Completed), "{what}");
            assert_eq!(one.events.len(), other.events.len(), "{what}");
            for (a, b) in one.events.iter().zip(&other.events) {
                assert_eq!(a.description, b.description, "{what} at {} {}", a.time, b.time);
                assert!((a.time - b.time).abs() < 1e-5, "{what}: {a:?} {b:?}");
            }
            for physical in [Physical::Angle, Physical::Speed, Physical::Charge, Physical::Current] {
                let worst = difference(one, other, physical);
                assert!(worst < 1e-8, "{what} {physical:?}: {worst:e}");
            }
            assert!(
                other.energy.residual.abs() < 1e-8 * other.energy.input.abs().max(1e-3),
                "{what}: {:?}",
                other.energy
            );
        }
    }
}

/// A tighter tolerance gives a smaller error, in proportion: what is asked for is about what comes.
#[test]
fn the_error_follows_the_tolerance() {
    let of = |tolerance: f64| runs(builtin("sia-steering"), Method::Taylor, tolerance, &["beta-30deg"]).remove(0);
    let reference = of(1e-13);
    for tolerance in [1e-5, 1e-7, 1e-9] {
        let worst = difference(&reference, &of(tolerance), Physical::Angle);
        assert!(worst < 10.0 * tolerance, "{tolerance:e}: {worst:e}");
    }
}

/// Bent joints, laws with a clock and quantised sensors, motors with lag and limits: the same as by the reference within what such a loop
/// makes of rounding.
#[test]
fn sampled_loops_go_the_same_way() {
    let [one, other] = [Method::Dop853, Method::Taylor]
        .map(|method| runs(builtin("sia-steering-ecu"), method, 1e-10, &["rack-30deg"]).remove(0));
    assert_eq!(other.outcome, Outcome::Completed);
    let worst = difference(&one, &other, Physical::Angle);
    assert!(worst < 1e-6, "{worst:e}");
    assert!(other.effort.evaluations < one.effort.evaluations, "{:?} {:?}", one.effort, other.effort);
}

/// A law that computes by itself at every instant is run by the reference method, whatever is asked.
#[test]
fn laws_of_their_own_are_run_by_the_reference() {
    let law = "law = \"computed_torque\"\n";
    let source = builtin("harmonic-drive").replace(law, &format!("{law}friction_width = \"0.1 rad/s\"\n"));
    let [one, other] =
        [Method::Dop853, Method::Taylor].map(|method| runs(&source, method, 1e-8, &["position-friction"]).remove(0));
    assert_eq!(one.outcome, Outcome::Completed);
    assert_eq!(one.effort, other.effort);
    assert_eq!(one.series, other.series);
}
