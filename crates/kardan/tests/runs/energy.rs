//! The energy balance: what it is relative to, and runs of which it says that they are wrong.

use crate::common::run;

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
    assert!(energy.left_out().is_some_and(|part| part < 1e-9), "{energy:?}");
    assert!(run.warnings.is_empty(), "{:?}", run.warnings);
}

/// A slider-crank with 4.5 J and a rod of this length, mm, on a crank of 50 mm.
fn slider_crank(rod: u32) -> kardan::results::Run {
    run(&format!(
        "[parameters]\nr = \"50 mm\"\nl = \"{rod} mm\"\n[shaft.crank]\ninertia = \"0.01 kg m^2\"\n[mass.piston]\nmass = \"0.5 kg\"\n\
         [constraint.rod]\nexpression = \"((piston.s - r*cos(crank.phi))^2 + (r*sin(crank.phi))^2 - l^2) / l\"\n\
         [scenario]\nduration = \"0.3 s\"\ninitial = {{ \"crank.w\" = \"30 rad/s\", \"piston.s\" = \"{} mm\" }}\n",
        50 + rod
    ))
}

/// With a rod as long as the crank there is a place at dead centre from which two motions go on, which no step may cross; with a longer one the 4.5 J
/// of the start are what the residual is measured by, as no input gives anything.
#[test]
fn a_run_through_a_singular_place_is_in_doubt() {
    let run = slider_crank(50);
    assert!(run.energy.left_out().is_some_and(|part| part > 0.5), "{:?}", run.energy);
    let [warning] = &run.warnings[..] else { panic!("{:?}", run.warnings) };
    let said = "the energy balance does not close: 4.500e0 J are not accounted for, of 4.500e0 J that were exchanged.";
    assert!(warning.starts_with(said), "{warning}");
    let run = slider_crank(150);
    assert!((run.energy.exchanged - 4.5).abs() < 1e-12, "{:?}", run.energy);
    assert!(run.energy.left_out().is_some_and(|part| part < 1e-9) && run.warnings.is_empty(), "{:?}", run.energy);
}

/// Where nothing moves there is nothing to lose.
#[test]
fn nothing_exchanged_has_no_part_left_out() {
    let run = run("[shaft.a]\ninertia = \"1 kg m^2\"\n[scenario]\nduration = \"1 s\"\n");
    assert_eq!((run.energy.exchanged, run.energy.left_out(), run.warnings.len()), (0.0, None, 0));
}
