//! The energy balance: what it is relative to, and runs of which it says that they are wrong.

use crate::common::run;
use kardan::results::Outcome;
use kardan::simulate::Method;
use kardan::study::{self, Project};

/// A torque sin(2πt) over one whole period on one kg m² at rest: `W(t) = ½ ((1 − cos 2πt) / 2π)²` comes and goes, so that nothing is left of it in net
/// terms, and 1/π² J were exchanged, counted between steps: at most that.
#[test]
fn what_comes_and_goes_is_exchanged() {
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
                 [scenario]\nduration = \"1 s\"\nsignals = { \"m.tau\" = \"1 N m * sin(2 pi t / 1 s)\" }\n";
    let run = run(model);
    let (energy, both) = (run.energy, std::f64::consts::PI.powi(-2));
    assert!(energy.input.abs() < 1e-10 && energy.stored.abs() < 1e-10, "{energy:?}");
    assert!(0.9 * both < energy.exchanged && energy.exchanged <= both * (1.0 + 1e-9), "{energy:?} {both}");
    assert!(energy.residual_share().is_some_and(|part| part < 1e-9), "{energy:?}");
    assert!(run.warnings.is_empty(), "{:?}", run.warnings);
}

/// A slider-crank with 4.5 J and a rod of this length, mm, on a crank of 50 mm.
fn slider_crank(rod: u32) -> String {
    format!(
        "[parameters]\nr = \"50 mm\"\nl = \"{rod} mm\"\n[shaft.crank]\ninertia = \"0.01 kg m^2\"\n[mass.piston]\nmass = \"0.5 kg\"\n\
         [constraint.rod]\nexpression = \"((piston.s - r*cos(crank.phi))^2 + (r*sin(crank.phi))^2 - l^2) / l\"\n\
         [scenario]\nduration = \"0.3 s\"\ninitial = {{ \"crank.w\" = \"30 rad/s\", \"piston.s\" = \"{} mm\" }}\n",
        50 + rod
    )
}

/// With a rod as long as the crank there is a place at dead centre from which two motions go on: a run ends there, at the time at which `½ (J + m s′²) ω²`,
/// s = 2 r cos φ, comes to φ = π/2. With a longer one the 4.5 J of the start are what the residual is measured by, as no input gives anything.
#[test]
fn a_run_ends_at_a_singular_place() {
    let (parts, right) = (1000, std::f64::consts::FRAC_PI_2);
    let slowness = |phi: f64| ((0.01 + 0.5 * (0.1 * phi.sin()).powi(2)) / 9.0).sqrt();
    let h = right / f64::from(parts);
    // Simpson's rule, of a function whose errors cancel over a quarter of its period.
    let inner = (1..parts).map(|k| slowness(h * f64::from(k)) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum::<f64>();
    let expected = h / 3.0 * (slowness(0.0) + inner + slowness(right));
    for method in [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau] {
        let settings = study::Settings { method, ..study::Settings::default() };
        let run = Project::open(slider_crank(50)).run(&settings, &study::Silent).expect("a run").runs.remove(0);
        let Outcome::Failed { time, cause } = &run.outcome else { panic!("{method:?}: {:?}", run.outcome) };
        assert!((time - expected).abs() < 1e-5, "{method:?}: {time} {expected}");
        assert!(cause.contains("`rod` constrains no motion in this position"), "{cause}");
    }
    let run = run(&slider_crank(150));
    assert!((run.energy.exchanged - 4.5).abs() < 1e-12, "{:?}", run.energy);
    assert!(run.energy.residual_share().is_some_and(|part| part < 1e-9) && run.warnings.is_empty(), "{:?}", run.energy);
}

/// Two rows of a crank and a rod as long as it: they become dependent together.
#[test]
fn rows_that_become_dependent_end_a_run() {
    let source = |rod: &str, duration: &str| {
        format!(
            "[parameters]\nr = \"0.1 m\"\nl = \"{rod}\"\n[shaft.crank]\ninertia = \"0.02 kg m^2\"\n[shaft.rod]\ninertia = \"0.004 kg m^2\"\n\
             [mass.p]\nmass = \"1.5 kg\"\n[constraint.a]\nexpression = \"p.s - r * cos(crank.phi) - l * cos(rod.phi)\"\n\
             [constraint.b]\nexpression = \"r * sin(crank.phi) - l * sin(rod.phi)\"\n\
             [scenario]\nduration = \"{duration}\"\ninitial = {{ \"crank.phi\" = \"30 deg\", \"crank.w\" = \"10 rad/s\" }}\n"
        )
    };
    let run_of = |source: &str| {
        Project::open(source).run(&study::Settings::default(), &study::Silent).expect("a run").runs.remove(0)
    };
    let run = run_of(&source("0.1 m", "20 s"));
    let Outcome::Failed { time, cause } = &run.outcome else { panic!("{:?}", run.outcome) };
    assert!(
        *time < 1.0 && cause.contains("the constraints `a`, `b` become dependent in this position"),
        "{time} {cause}"
    );
    let last = |name: &str| *crate::common::signal(&run, name).last().expect("rows");
    assert!(last("crank.phi") < std::f64::consts::FRAC_PI_2 && (last("crank.phi") - last("rod.phi")).abs() < 1e-9);
    // Near such a place a run goes on.
    assert_eq!(run_of(&source("0.101 m", "3 s")).outcome, Outcome::Completed);
}

/// Where nothing moves there is nothing to lose.
#[test]
fn no_energy_exchange_gives_no_residual_share() {
    let run = run("[shaft.a]\ninertia = \"1 kg m^2\"\n[scenario]\nduration = \"1 s\"\n");
    assert_eq!((run.energy.exchanged, run.energy.residual_share(), run.warnings.len()), (0.0, None, 0));
}
