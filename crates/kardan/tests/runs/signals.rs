//! Sources as functions of time: against closed forms, against events, and the same whoever integrates.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use kardan::diagnostics::Severity;
use kardan::results::{Outcome, Run};
use kardan::simulate::{Method, Scenario, Setup, Simulation, Tolerance, simulate};
use kardan::study::{Project, Settings, Silent};

use crate::common::{at, prepared, run, run_by, runs_only, signal};

/// A body on a spring to the housing, on which a torque acts.
const OSCILLATOR: &str = "\
[shaft.a]
inertia = \"2 kg m^2\"
[spring_damper.s]
shaft_1 = \"a\"
stiffness = \"50 N m/rad\"
DAMPING
[disturbance.load]
shaft = \"a\"
";

fn oscillator(damped: bool, signals: &str, load: &str, duration: &str) -> String {
    let model = OSCILLATOR.replace("DAMPING", if damped { "damping = \"1 N m s/rad\"" } else { "" });
    format!("{model}{signals}[scenario]\nduration = \"{duration}\"\nsignals = {{ load = \"{load}\" }}\n")
}

fn by(source: &str, method: Method, tolerance: f64) -> Run {
    run_by(source, method, Some(tolerance))
}

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

const WAVE: &str =
    "[signal.wave]\nkind = \"sine\"\namplitude = \"3 N m\"\nfrequency = \"0.5 Hz\"\nphase = \"30 deg\"\n";
const PULSES: &str = "[signal.knocks]\nkind = \"pulses\"\nhigh = \"5 N m\"\nlow = \"1 N m\"\nperiod = \"0.3 s\"\n\
                      width = \"0.1 s\"\nstart = \"0.1 s\"\ncount = 4\n";

/// `2 φ̈ + 50 φ = 3 sin(π t + 30°)` from rest: the forced motion and the free one that begins with it.
#[test]
fn a_sine_drives_a_body_on_a_spring_as_in_closed_form() {
    let (inertia, stiffness, size, omega, phase) = (2.0, 50.0, 3.0, PI, PI / 6.0);
    let own = f64::sqrt(stiffness / inertia);
    let forced = size / (stiffness - inertia * omega * omega);
    let exact = |t: f64| {
        forced
            * ((omega * t + phase).sin() - phase.sin() * (own * t).cos() - omega / own * phase.cos() * (own * t).sin())
    };
    let formula = "3 N m * sin(2 pi t / 2 s + 30 deg)";
    for (signals, load) in [(WAVE, "wave"), ("", formula)] {
        for method in METHODS {
            let run = by(&oscillator(false, signals, load, "5 s"), method, 1e-12);
            for (t, angle) in run.series.time.iter().zip(signal(&run, "a.phi")) {
                assert!((angle - exact(*t)).abs() < 1e-9, "{method:?} {t}: {angle} {}", exact(*t));
            }
            let driven = run.series.time.iter().zip(signal(&run, "load"));
            driven.for_each(|(t, torque)| assert!((torque - size * (omega * t + phase).sin()).abs() < 1e-14, "{t}"));
        }
    }
}

/// Before its start a sine is its offset; then it begins with its phase.
#[test]
fn a_sine_begins_at_its_start() {
    let late = WAVE.to_string() + "start = \"0.35 s\"\noffset = \"2 N m\"\n";
    let run = run(&oscillator(true, &late, "wave", "1 s"));
    for (t, torque) in run.series.time.iter().zip(signal(&run, "load")).filter(|(t, _)| (**t - 0.35).abs() > 1e-12) {
        let expected = if *t < 0.35 { 2.0 } else { 2.0 + 3.0 * (PI * (t - 0.35) + PI / 6.0).sin() };
        assert!((torque - expected).abs() < 1e-14, "{t}: {torque} {expected}");
    }
}

/// The phase of a chirp is the integral of its frequency, here by Simpson's rule; it ends at its end.
#[test]
fn the_phase_of_a_chirp_is_the_integral_of_its_frequency() {
    let (from, to, over, start) = (1.0, 9.0, 2.0, 0.25);
    let linear = |x: f64| from + (to - from) * x / over;
    let logarithmic = |x: f64| from * f64::powf(to / from, x / over);
    let all: [(&str, &dyn Fn(f64) -> f64); 2] = [("linear", &linear), ("logarithmic", &logarithmic)];
    for (sweep, frequency) in all {
        let chirp = format!(
            "[signal.c]\nkind = \"chirp\"\namplitude = \"2 N m\"\nfrom = \"{from} Hz\"\nto = \"{to} Hz\"\nover = \"{over} s\"\n\
             start = \"{start} s\"\nsweep = \"{sweep}\"\noffset = \"1 N m\"\nphase = \"1 rad\"\n"
        );
        let run = run(&oscillator(true, &chirp, "c", "3 s"));
        for (t, torque) in run.series.time.iter().zip(signal(&run, "load")).step_by(37) {
            let x = t - start;
            let waves = |x: f64| {
                let (n, h) = (2000, x / 4000.0);
                let part = |k: usize| {
                    let at = 2.0 * h * k as f64;
                    h / 3.0 * (frequency(at) + 4.0 * frequency(at + h) + frequency(at + 2.0 * h))
                };
                (0..n).map(part).sum::<f64>()
            };
            let on = (0.0..over).contains(&x);
            let expected = if on { 1.0 + 2.0 * (TAU * waves(x) + 1.0).sin() } else { 1.0 };
            assert!((torque - expected).abs() < 1e-10, "{sweep} {t}: {torque} {expected}");
        }
    }
}

/// Each step of a train of pulses is an event at the number nearest to its time, and steps of the integrator end there.
#[test]
fn pulses_step_at_their_exact_times() {
    for method in METHODS {
        let run = by(&oscillator(true, PULSES, "knocks", "2 s"), method, 1e-10);
        let found: Vec<(f64, &str)> = run.events.iter().map(|event| (event.time, event.description.as_str())).collect();
        let mut expected = Vec::new();
        for begin in [0.1, 0.4, 0.7, 1.0] {
            expected.push((begin, "knocks steps to 5 N m"));
            // 0.2, 0.5, 0.8, 1.1 as they are written.
            expected.push((f64::round(10.0 * begin + 1.0) / 10.0, "knocks steps to 1 N m"));
        }
        assert_eq!(found, expected, "{method:?}");
    }
}

/// The response to pulses is that to the same steps as events.
#[test]
fn pulses_are_steps() {
    let mut events = oscillator(true, "", "0 N m", "2 s");
    let steps = [(0.0, 1), (0.1, 5), (0.2, 1), (0.4, 5), (0.5, 1), (0.7, 5), (0.8, 1), (1.0, 5), (1.1, 1)];
    for (time, level) in steps {
        events += &format!("[[scenario.event]]\nat = \"{time} s\"\nsignal = \"load\"\nto = \"{level} N m\"\n");
    }
    for method in METHODS {
        let (one, other) = (by(&oscillator(true, PULSES, "knocks", "2 s"), method, 1e-11), by(&events, method, 1e-11));
        for t in [0.05, 0.3, 1.0, 2.0] {
            assert!((at(&one, "a.phi", t) - at(&other, "a.phi", t)).abs() < 1e-12, "{method:?} {t}");
        }
    }
}

/// A table of a straight line, a ramp, and the event that ramps are one source; the sampled law that reads it as a reference takes the same
/// bits of it.
#[test]
fn a_straight_line_is_a_ramp() {
    let model = "\
[shaft.a]
inertia = \"1 kg m^2\"
damping = \"1 N m s/rad\"
[motor.m]
shaft = \"a\"
[control.c]
law = \"decoupling\"
inputs = [\"m\"]
sample_time = \"10 ms\"
[[control.c.channels]]
output = \"a.phi\"
reference = \"ref\"
";
    let scenario = "[scenario]\nduration = \"2 s\"\n";
    let event = "[[scenario.event]]\nat = \"0.5 s\"\nsignal = \"ref\"\nto = \"3 rad\"\nover = \"1 s\"\n";
    let ramp = "[signal.r]\nkind = \"ramp\"\nto = \"3 rad\"\nstart = \"0.5 s\"\nover = \"1 s\"\n";
    let table = "[signal.r]\nkind = \"table\"\npoints = { time = [\"0.5 s\", \"1.5 s\"], value = [\"0 rad\", \"3 rad\"] }\n\
                 extrapolation = \"hold\"\n";
    let first = run(&format!("{model}{scenario}{event}"));
    for signals in [ramp, table] {
        let other = run(&format!("{model}{signals}{scenario}signals = {{ ref = \"r\" }}\n"));
        for name in ["ref", "a.phi", "m.tau"] {
            for (row, t) in other.series.time.iter().enumerate() {
                let same = first.series.time.iter().position(|time| time == t).expect("a row of both");
                assert_eq!(
                    signal(&other, name)[row].to_bits(),
                    signal(&first, name)[same].to_bits(),
                    "{name} {t} {signals}"
                );
            }
        }
    }
}

/// Draws have the mean and the variance that they are asked for, within four standard errors; they are those of the seed.
#[test]
fn noise_is_that_of_its_seed() {
    let noise = |seed: &str| {
        let signals =
            format!("[signal.n]\nkind = \"noise\"\ndeviation = \"0.5 N m\"\nmean = \"2 N m\"\nhold = \"1 ms\"\n{seed}");
        run(&oscillator(true, &signals, "n", "4 s"))
    };
    let (one, again, other) = (noise("seed = 7\n"), noise("seed = 7\n"), noise("seed = 8\n"));
    assert_eq!(signal(&one, "a.phi"), signal(&again, "a.phi"));
    assert_ne!(signal(&one, "load"), signal(&other, "load"));
    // Those of the scenario, if it has none of its own.
    assert_ne!(signal(&noise(""), "load"), signal(&one, "load"));
    // A value for each millisecond: rows stand where the next one begins, but for rounding.
    let values = &signal(&one, "load")[..4000];
    let mean = values.iter().sum::<f64>() / 4e3;
    let variance = values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 4e3;
    assert!((mean - 2.0).abs() < 4.0 * 0.5 / 4e3f64.sqrt(), "{mean}");
    assert!((variance / 0.25 - 1.0).abs() < 4.0 * (2.0 / 4e3f64).sqrt(), "{variance}");
}

/// What a run of each method finds for products, cubics, repeated tables and expressions is one motion, and its energy balances.
#[test]
fn all_methods_find_one_motion_and_its_energy() {
    let signals = format!(
        "{WAVE}{PULSES}\
         [signal.road]\nkind = \"table\"\ninterpolation = \"cubic\"\nextrapolation = \"repeat\"\n\
         points = {{ time = [\"0.1 s\", \"0.2 s\", \"0.5 s\", \"0.7 s\"], value = [\"0 N m\", \"2 N m\", \"1 N m\", \"0 N m\"] }}\n\
         [signal.fading]\nkind = \"expression\"\nvalue = \"exp(-t / 0.5 s) * road\"\n"
    );
    let source = oscillator(true, &signals, "wave * knocks / 1 N m + fading - 0.3 * road^2 / 2 N m", "2 s");
    let runs = METHODS.map(|method| by(&source, method, 1e-11));
    for run in &runs {
        assert!(run.energy.residual.abs() < 1e-8 * run.energy.input.abs(), "{:?}", run.energy);
        for name in ["a.phi", "a.w", "load"] {
            for (a, b) in signal(run, name).iter().zip(signal(&runs[0], name)) {
                assert!((a - b).abs() < 1e-8, "{name}: {a} {b}");
            }
        }
    }
    // The product, where the pulse is high and where it is low.
    let project = Project::open(oscillator(true, &signals, "wave * knocks / 1 N m", "2 s"));
    let study = project.run(&runs_only(), &Silent).expect("no mistakes");
    for (t, level) in [(0.15, 5.0), (0.25, 1.0), (0.45, 5.0), (1.95, 1.0)] {
        let expected = level * 3.0 * (PI * t + PI / 6.0).sin();
        assert!((at(&study.runs[0], "load", t) - expected).abs() < 1e-13, "{t}");
    }
}

/// A loop with straight lines alone goes by exponentials: a step for each piece.
#[test]
fn straight_lines_are_solved_by_exponentials() {
    let run = by(&oscillator(true, PULSES, "2 * knocks + 1 N m/s * t", "2 s"), Method::Automatic, 1e-10);
    assert!(run.effort.steps <= 12, "{:?}", run.effort);
    let other = by(&oscillator(true, PULSES, "2 * knocks + 1 N m/s * t", "2 s"), Method::Dop853, 1e-12);
    for (a, b) in signal(&run, "a.phi").iter().zip(signal(&other, "a.phi")) {
        assert!((a - b).abs() < 1e-10, "{a} {b}");
    }
}

/// Stepped from outside it is the run, bit for bit, also from a snapshot; a source that is set from outside follows its function no more.
#[test]
fn a_simulation_follows_the_signals_until_they_are_set() {
    let source = oscillator(true, &format!("{WAVE}{PULSES}"), "wave + knocks", "2 s");
    let variant = prepared(&source).variants.remove(0);
    let times: Vec<f64> = (1..40).map(|k| 0.0487 * f64::from(k)).collect();
    let scenario = Scenario { times: times.clone(), ..variant.scenario.clone() };
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &scenario };
    let run = simulate(setup, Tolerance::default(), &mut |_| None);
    assert_eq!(run.outcome, Outcome::Completed);
    let mut stepped = Simulation::new(setup, Tolerance::default());
    let ids = ["a.phi", "a.w", "load"].map(|name| (name, stepped.signal(name).unwrap()));
    let mut snapshot = None;
    for (row, time) in times.iter().enumerate() {
        stepped.advance(*time).unwrap();
        for (name, id) in ids {
            let expected = run.series.signal(name).unwrap().values[row];
            assert_eq!(stepped.get(id).to_bits(), expected.to_bits(), "{name} at {time}");
        }
        if row == 20 {
            snapshot = Some(stepped.snapshot());
        }
    }
    stepped.restore(&snapshot.unwrap()).unwrap();
    stepped.advance(times[30]).unwrap();
    assert_eq!(stepped.get(ids[0].1).to_bits(), run.series.signal("a.phi").unwrap().values[30].to_bits());
    let load = stepped.input("load").unwrap();
    stepped.set(load, 0.25).unwrap();
    stepped.advance(1.7).unwrap();
    assert_eq!(stepped.get(ids[2].1), 0.25);
}

/// Parameters in signals are those of the variant.
#[test]
fn variants_have_signals_of_their_own() {
    let source = format!(
        "[parameters]\nsize = \"1 N m\"\nbeat = \"2 Hz\"\n[variants]\nsize = [\"1 N m\", \"3 N m\"]\n{}",
        oscillator(
            true,
            "[signal.w]\nkind = \"sine\"\namplitude = \"2 * size\"\nfrequency = \"beat\"\n",
            "w + size * sin(2 pi * beat * t)",
            "1 s"
        )
    );
    let study = Project::open(source).run(&runs_only(), &Silent).expect("no mistakes");
    for (run, size) in study.runs.iter().zip([1.0, 3.0]) {
        assert!((at(run, "load", 0.1) - 3.0 * size * (0.4 * PI).sin()).abs() < 1e-13, "{size}");
    }
}

/// A band of sines has the mean square that they have together, and with Schroeder's phases lower peaks than in phase.
#[test]
fn a_multisine_is_the_sum_of_its_sines() {
    let band = "[signal.m]\nkind = \"multisine\"\namplitude = \"1 N m\"\nfrom = \"1 Hz\"\nto = \"20 Hz\"\ncount = 20\n";
    let run_of = |signals: &str| run(&oscillator(true, signals, "m", "1 s"));
    let run = run_of(band);
    let values = signal(&run, "load");
    let phase = |k: f64| -PI * k * (k + 1.0) / 20.0;
    for (t, torque) in run.series.time.iter().zip(values) {
        let expected: f64 = (0..20).map(f64::from).map(|k| (TAU * (k + 1.0) * t + phase(k)).sin()).sum();
        assert!((torque - expected).abs() < 1e-11, "{t}: {torque} {expected}");
    }
    let peak = values.iter().fold(0.0f64, |most, x| most.max(x.abs()));
    let in_phase = |t: &f64| (0..20).map(f64::from).map(|k| (TAU * (k + 1.0) * t).sin()).sum::<f64>().abs();
    let in_phase_peak = run.series.time.iter().map(in_phase).fold(0.0, f64::max);
    assert!(peak < 0.45 * in_phase_peak, "{peak} {in_phase_peak}");
    let listed = "[[signal.m.line]]\namplitude = \"1 N m\"\nfrequency = \"2 Hz\"\nphase = \"90 deg\"\n\
                  [[signal.m.line]]\namplitude = \"0.5 N m\"\nfrequency = \"0.2 s\"\n";
    let run = run_of(&format!("[signal.m]\nkind = \"multisine\"\n{listed}"));
    let expected = (TAU * 0.2).cos() + 0.5 * (TAU * 0.5).sin();
    assert!((at(&run, "load", 0.1) - expected).abs() < 1e-14);
}

/// A project with a table of a file.
fn of_file(text: Result<&str, &str>, keys: &str) -> Project {
    let table = format!("[signal.road]\nkind = \"table\"\nfile = \"road.csv\"\n{keys}");
    let project = Project::open(oscillator(true, &table, "road", "1 s"));
    assert_eq!(project.files(), ["road.csv"]);
    let bytes = text.map(|text| Arc::from(text.as_bytes())).map_err(Into::into);
    project.with_files([("road.csv".to_string(), bytes)])
}

/// Columns of a file have names and units.
#[test]
fn a_table_comes_from_a_file() {
    let text = "time;torque;angle\nms;mN m;deg\n0;0;1\n500;2000;2\n1000;1000;3\n";
    let study = of_file(Ok(text), "column = \"torque\"\n").run(&Settings::default(), &Silent).expect("no mistakes");
    for (t, expected) in [(0.25, 1.0), (0.5, 2.0), (0.75, 1.5), (1.0, 1.0)] {
        assert!((at(&study.runs[0], "load", t) - expected).abs() < 1e-14, "{t}");
    }
}

/// What is wrong with a file is told where the model names it.
#[test]
fn errors_of_files_are_reported() {
    let missing = "there is no file `road.csv`";
    for (text, keys, expected) in [
        (Err(missing), "", missing),
        (Ok(""), "", "empty"),
        (
            Ok("time,torque\ns,N m\n0,1\n1\n2,3\n"),
            "",
            "not every row could be read: 1 row is left out: it has not the 2 cells",
        ),
        (Ok("time,torque\ns,N m\n0,1\n1,\n2,3\n"), "", "the value of point 2 is not a number"),
        (Ok("time,torque\ns,N m\n0,1\n2,3\n2,4\n"), "", "the times do not increase: 2 s after 2 s (point 3)"),
        (Ok("time,torque\ns,N m\n0,1\n0.5,3\n"), "", "the points are from 0 s to 0.5 s, the run is from 0 s to 1 s"),
        (Ok("time,torque\ns,N m\n0,1\n1,3\n"), "column = \"torqe\"\n", "there is no column `torqe`"),
        (Ok("time,torque,angle\ns,N m,deg\n0,1,2\n1,3,4\n"), "", "2 columns may be the values"),
        (Ok("time,torque\ns,wizards\n0,1\n1,3\n"), "", "the unit `wizards` is not known"),
        (Ok("time,torque\ns,deg\n0,1\n1,3\n"), "", "expected a torque, found an angle"),
        (Ok("\u{0}\u{1}\u{2}garbage"), "", "road.csv"),
    ] {
        let project = of_file(text, keys);
        let wrong: Vec<_> = project.diagnostics().iter().filter(|d| d.severity == Severity::Error).collect();
        assert_eq!(wrong.len(), 1, "{text:?}: {wrong:?}");
        assert!(wrong[0].message.contains(expected), "{text:?}: {}", wrong[0].message);
        assert!(!wrong[0].labels.is_empty() && wrong[0].help.is_some(), "{wrong:?}");
    }
}

/// A position loop whose reference is a signal of that name.
fn following(signal: &str) -> String {
    format!(
        "[shaft.arm]\ninertia = \"0.01 kg m^2\"\n[motor.m]\nshaft = \"arm\"\n[sensor.pull]\nmeasures = \"net_torque\"\nshaft = \"arm\"\n\
         [control.c]\nlaw = \"position_loop\"\noutput = \"arm.phi\"\ninput = \"m\"\nreference = \"wish\"\nnatural_frequency = \"20 rad/s\"\ndamping_ratio = 1\n\
         [signal.wish]\n{signal}[scenario]\nduration = \"1 s\"\noutput_step = \"10 ms\"\n"
    )
}

/// A reference follows the signal that has its name: behind a ramp of rate v a loop with two poles at −p is `v (t − 2/p + (t + 2/p) e^{−p t})`.
#[test]
fn a_reference_follows_the_signal_of_its_name() {
    let source = following("kind = \"ramp\"\nto = \"3 rad\"\nover = \"2 s\"\n");
    let run = run_by(&source, Method::Automatic, Some(1e-11));
    for k in 0..=100 {
        let t = f64::from(k) / 100.0;
        let expected = 1.5 * (t - 0.1 + (t + 0.1) * (-20.0 * t).exp());
        let found = at(&run, "arm.phi", t);
        assert!((found - expected).abs() < 1e-8, "{found} for {expected} at {t} s");
        assert!((at(&run, "wish", t) - 1.5 * t).abs() < 1e-12);
    }
}

/// What is no angle cannot be followed by one, and what needs samples has no value at every instant: both are told at the reference.
#[test]
fn a_reference_is_reported_of_a_signal_that_does_not_fit() {
    for (signal, message) in [
        (
            "kind = \"ramp\"\nto = \"3 N m\"\nover = \"2 s\"\n",
            "control `c`: the signal `wish`, which is its reference: expected an angle, found a torque",
        ),
        (
            "kind = \"expression\"\nvalue = \"2 * arm.w\"\n",
            "control `c`: `wish` should be an angle, but the block outputs an angular velocity",
        ),
        (
            "kind = \"expression\"\nvalue = \"pull * 1 rad / 1 N m\"\n",
            "control `c`: the signal `wish`, which is its reference, reads `pull`, which needs samples: it has no value at every instant",
        ),
    ] {
        let source = following(signal);
        let project = Project::open(source.as_str());
        let reported = project.diagnostics().iter().find(|one| one.message == message);
        let reported = reported.unwrap_or_else(|| panic!("{:#?} for {message}", project.diagnostics()));
        let span = reported.labels[0].place.span();
        assert_eq!(source[span].trim_matches('"'), "wish", "{reported:?}");
        assert!(reported.help.is_some());
    }
}
