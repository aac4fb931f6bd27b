//! Requirements and plots of expressions of signals, against closed forms.

use kardan::results::{Physical, Run, Study};
use kardan::study::{Settings, Silent};

fn study_of(source: &str) -> Study {
    crate::common::project(source).run(&Settings::default(), &Silent).unwrap_or_else(|why| panic!("{why:?}"))
}

fn measured(run: &Run, number: usize) -> f64 {
    run.requirements[number].measured.unwrap_or(f64::NAN)
}

/// A row says what it measures against: the target, in the unit of the signal, and the band.
#[test]
fn rows_name_the_target_and_the_band() {
    let requirement = |keys: &str| format!("[[requirement]]\nsignal = \"my-shaft.phi\"\n{keys}\n");
    let source = [
        PUSHED,
        &requirement("measure = \"settling_time\"\ntarget = \"2 rad\"\nband = \"5 %\"\nbelow = \"6 s\""),
        &requirement("measure = \"settling_time\"\nband = \"0.1 rad\"\nbelow = \"6 s\""),
        &requirement("measure = \"overshoot\"\ntarget = \"0.3 rad\"\nbelow = \"20 %\""),
        &requirement("measure = \"iae\"\ntarget = \"0.1 rad\"\nbelow = \"6 rad s\""),
        &requirement("measure = \"max\"\nbelow = \"6 rad\""),
    ]
    .concat();
    let study = study_of(&source);
    let rows: Vec<&str> = study.runs[0].requirements.iter().rev().take(5).map(|row| row.text.as_str()).collect();
    assert_eq!(
        rows,
        [
            "max my-shaft.phi < 6 rad",
            "iae my-shaft.phi (to 0.1 rad) < 6 s rad",
            "overshoot my-shaft.phi (to 0.3 rad) < 0.2",
            "settling_time my-shaft.phi (to its last value ± 0.1 rad) < 6 s",
            "settling_time my-shaft.phi (to 2 rad ± 5 % of the way) < 6 s",
        ]
    );
}

/// A shaft of 1 kg m² under 2 N m from the start: w = 2 t, phi = t², power 4 t, energy 2 t².
const PUSHED: &str = r#"
[parameters]
torque = "2 N m"
size = "1 kg m^2"

[variants]
size = ["size", "size * 4"]

[shaft.my-shaft]
inertia = "size"

[motor.m]
shaft = "my-shaft"

[scenario]
duration = "1 s"
output_step = "1 ms"

[[scenario.event]]
at = "0 s"
signal = "m.tau"
to = "torque"

[[scenario.event]]
at = "0.5 s"
signal = "m.tau"
to = "torque"

[[requirement]]
signal = "'my-shaft.phi' - torque / size / 2 * t^2 * 1 rad"
measure = "max_abs"
below = "1e-9 rad"

[[requirement]]
signal = "m.tau * 'my-shaft.w'"
measure = "energy"
above = "0.4 J"

[[requirement]]
signal = "m.tau * 'my-shaft.w'"
measure = "final"
below = "1 kW"

[[requirement]]
signal = "'my-shaft.phi'"
measure = "iae"
above = "0 rad s"
below = "1 rad s"

[[requirement]]
signal = "m.tau"
measure = "events"
below = 10

[[requirement]]
signal = "t"
measure = "events"
from = "0.25 s"
below = 2

[[requirement]]
signal = "'my-shaft.w' / (t - 1 s/2)"
measure = "max"
below = "1 rad/s^2"

[[plot]]
name = "orbit"
title = "Orbit"
signals = ["'my-shaft.w' * size / torque"]
references = ["-t / 1 s"]
over = "my-shaft.phi"
x_scale = "log"
"#;

#[test]
fn expressions_are_judged_row_by_row() {
    let study = study_of(PUSHED);
    assert_eq!(study.runs.len(), 2);
    for (run, size) in study.runs.iter().zip([1.0, 4.0]) {
        assert!(measured(run, 0) < 1e-9, "{:?}", run.requirements[0]);
        // The power is a straight line: nothing is lost between the rows.
        assert!((measured(run, 1) - 2.0 / size).abs() < 1e-9 && run.requirements[1].unit == "J");
        assert!((measured(run, 2) - 4.0 / size).abs() < 1e-9, "{:?}", run.requirements[2]);
        // The trapezium rule of t²/size: h²/12 of the difference of the slopes too much, less where rows are closer.
        let excess = measured(run, 3) * size - 1.0 / 3.0;
        assert!((0.0..1.0001e-6 / 6.0).contains(&excess), "{:?}", run.requirements[3]);
        assert_eq!((measured(run, 4), measured(run, 5)), (2.0, 1.0), "{:?}", run.events);
        assert!(!run.requirements[6].passed && run.requirements[6].measured.is_none());
        let reported = "has no value: the expression is no number in some rows of its window";
        assert!(run.notes.iter().any(|note| note.contains(reported)), "{:?}", run.notes);
        let orbit = run.series.signal("'my-shaft.w' * size / torque").unwrap();
        assert_eq!(orbit.physical.unit(), "s");
        assert!(orbit.values.iter().zip(&run.series.time).all(|(value, time)| (value - time).abs() < 1e-9));
        assert_eq!(run.series.signal("m.tau * 'my-shaft.w'").unwrap().physical, Physical::of_unit("W"));
    }
    let plot = &study.plots[0];
    assert!(!plot.references[0].opposite && plot.references[0].signal == "-t / 1 s" && plot.log_x && !plot.log_y);
}

/// The step response of J q'' + d q' + c q = c r: overshoot exp(-π z/√(1-z²)) whatever is integrated how.
#[test]
fn overshoot_of_a_run_has_its_closed_form() {
    let source = r#"
[shaft.a]
inertia = "1 kg m^2"
[spring_damper.s]
shaft_1 = "a"
stiffness = "100 N m/rad"
damping = "4 N m s/rad"
[motor.m]
shaft = "a"
[scenario]
duration = "4 s"
[[scenario.event]]
at = "0 s"
signal = "m.tau"
to = "50 N m"
[[requirement]]
signal = "2 * a.phi"
measure = "overshoot"
target = "1 rad"
below = 0.6
[[requirement]]
signal = "2 * a.phi"
measure = "settling_time"
target = "1 rad"
band = 0.02
below = "2.2 s"
[[plot]]
name = "spectrum"
title = "Spectrum"
signals = ["a.phi"]
kind = "spectrum"
y_scale = "log"
"#;
    let study = study_of(source);
    let run = &study.runs[0];
    let z = 0.2_f64;
    let expected = (-std::f64::consts::PI * z / (1.0 - z * z).sqrt()).exp();
    assert!((measured(run, 0) - expected).abs() < 2e-5, "{:?} {expected}", run.requirements);
    // Behind this time the envelope exp(-z w t)/√(1-z²) is within 2 %; half a period before it is not yet.
    let envelope = -(0.02 * (1.0 - z * z).sqrt()).ln() / (z * 10.0);
    let half = std::f64::consts::PI / (10.0 * (1.0 - z * z).sqrt());
    assert!((envelope - half..=envelope).contains(&measured(run, 1)), "{:?} {envelope}", run.requirements[1]);
    let spectrum = &study.spectra[0];
    assert_eq!((spectrum.frequency.len(), spectrum.missing.clone()), (2000, None));
    assert!((spectrum.frequency[0] - 0.25).abs() < 1e-12);
}
