//! Motors that controllers drive by a voltage, and currents that events prescribe; against closed forms.

use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{DesignSettings, Project, Silent};

use crate::common::{at, run_by, runs_only, signal};

const METHODS: [Method; 4] = [Method::Taylor, Method::Dop853, Method::Radau, Method::Automatic];

fn by(source: &str, method: Method) -> Run {
    let run = run_by(source, method, Some(1e-10));
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

fn near(value: f64, expected: f64, tolerance: f64, what: &str) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value} instead of {expected}");
}

const MOTOR: &str = "[voltage_source.V]\nfrom = \"ground\"\nto = \"in\"\n[dc_motor.M]\nfrom = \"in\"\nto = \"ground\"\nshaft = \"rotor\"\n\
                     torque_constant = \"0.05 N m/A\"\nresistance = \"0.8 Ohm\"\ninductance = \"2 mH\"\n[shaft.rotor]\ninertia = \"1e-4 kg m^2\"\n\
                     damping = \"1e-5 N m s/rad\"\n";

const PLACED: &str = "[control.servo]\nlaw = \"pole_placement\"\ninputs = [\"V\"]\npoles = [-50, \"-100 ± 80j\"]\n[[control.servo.channels]]\n\
                      output = \"rotor.phi\"\nreference = \"wanted\"\n";

const STEP: &str = "[scenario]\nduration = \"0.2 s\"\noutput_step = \"1 ms\"\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"wanted\"\nto = \"1 rad\"\n";

/// The gains over current, angle and speed that give `s³ + a₂ s² + a₁ s + a₀`: `L i' = u − R i − k w`, `J w' = k i − d w`, `u = −K x`.
fn gains([a2, a1, a0]: [f64; 3]) -> [f64; 3] {
    let (l, r, k, j, d) = (2e-3, 0.8, 0.05, 1e-4, 1e-5);
    let current = l * (a2 - d / j) - r;
    let speed = j * l / k * (a1 - (r + current) * d / (j * l)) - k;
    [current, j * l / k * a0, speed]
}

/// A motor with inductance has three poles behind its voltage: the charge of its circuit is no state that a law holds.
#[test]
fn a_voltage_places_the_poles_of_a_motor() {
    // (s + 50) (s² + 200 s + 16400)
    let wanted = [250.0, 26_400.0, 820_000.0];
    let [current, angle, speed] = gains(wanted);
    let design = Project::open(format!("{MOTOR}{PLACED}{STEP}"))
        .design(&DesignSettings::default(), &Silent)
        .unwrap_or_else(|told| panic!("{told:?}"));
    let gain = design.gains.iter().find(|gain| gain.name == "K").expect("a gain");
    for (name, expected) in [("M.i", current), ("rotor.phi", angle), ("rotor.w", speed)] {
        let own = |state: &String| state == name || name == "M.i" && state == "V.i";
        let column = gain.columns.iter().position(own).unwrap_or_else(|| panic!("{name} in {:?}", gain.columns));
        near(gain.values[0][column], expected, 1e-9 * expected.abs(), name);
    }
    assert_eq!(gain.columns.len(), 3, "{:?}", gain.columns);
    let mut poles: Vec<[f64; 2]> = design.closed_loop_poles.iter().map(|pole| [pole.re, pole.im]).collect();
    poles.sort_by(|a, b| a[1].total_cmp(&b[1]));
    for ([re, im], expected) in poles.iter().zip([[-100.0, -80.0], [-50.0, 0.0], [-100.0, 80.0]]) {
        near(*re, expected[0], 1e-6, "re");
        near(*im, expected[1], 1e-6, "im");
    }
    assert_eq!(poles.len(), 3, "{poles:?}");
    assert!(design.warnings.iter().all(|warning| !warning.contains("stable")), "{:?}", design.warnings);
}

/// The step of `a₀/((s + 50)(s² + 200 s + 16400))` in partial fractions, and the voltage that it takes.
#[test]
fn a_servo_runs_on_its_voltage() {
    let (p, sigma, omega) = (50.0, 100.0, 80.0);
    let square = sigma * sigma + omega * omega;
    let a0 = p * square;
    // 1 + A e^(−pt) + e^(−σt) (B cos ωt + C sin ωt)
    let a = -a0 / (p * (square - 2.0 * sigma * p + p * p));
    let b = -1.0 - a;
    let c = (p * a + sigma * b) / omega;
    let angle =
        |t: f64| 1.0 + a * (-p * t).exp() + (-sigma * t).exp() * (b * (omega * t).cos() + c * (omega * t).sin());
    let source = format!("{MOTOR}{PLACED}{STEP}");
    for method in METHODS {
        let run = by(&source, method);
        for t in [0.005, 0.02, 0.05, 0.2] {
            near(at(&run, "rotor.phi", t), angle(t), 1e-8, &format!("{method:?} at {t}"));
        }
        // At once the whole reference gain is the voltage.
        near(signal(&run, "V.v")[0], gains([250.0, 26_400.0, 820_000.0])[1], 1e-9, "volts");
        assert!(
            run.energy.residual.abs() <= 1e-8 * run.energy.input.abs().max(run.energy.dissipated),
            "{:?}",
            run.energy
        );
    }
}

/// `voltage_limit` bounds what is given; what was asked for is a column.
#[test]
fn a_source_has_a_limit() {
    let source = format!("{MOTOR}{PLACED}{STEP}").replace("to = \"in\"", "to = \"in\"\nvoltage_limit = \"3 V\"");
    let run = by(&source, Method::Automatic);
    assert!(signal(&run, "V.v").iter().all(|volts| volts.abs() <= 3.0 + 1e-12));
    near(signal(&run, "V.v")[0], 3.0, 0.0, "at its limit");
    near(signal(&run, "V.command")[0], gains([250.0, 26_400.0, 820_000.0])[1], 1e-9, "asked for");
    near(at(&run, "rotor.phi", 0.2), 1.0, 1e-3, "it arrives");
}

/// Every law that takes inputs takes voltages: what of the loop is asked for holds.
#[test]
fn other_laws_take_voltages() {
    let laws =
        ["law = \"lqr\"\ninputs = [\"V\"]\nlargest = { V = \"10 V\" }\n", "law = \"decoupling\"\ninputs = [\"V\"]\n"];
    for law in laws {
        let channels = "[[control.servo.channels]]\noutput = \"rotor.phi\"\nreference = \"wanted\"\n";
        let own = if law.contains("decoupling") { "poles = [-50, \"-100 ± 80j\"]\n" } else { "" };
        let source = format!("{MOTOR}[control.servo]\n{law}{channels}{own}{STEP}").replace("0.2 s", "1 s");
        let run = Project::open(&source)
            .run(&runs_only(), &Silent)
            .unwrap_or_else(|told| panic!("{told:?}\n{source}"))
            .runs
            .remove(0);
        assert_eq!(run.outcome, Outcome::Completed);
        near(at(&run, "rotor.phi", 1.0), 1.0, 1e-3, law);
    }
}

/// A sampled law holds the same voltage between its samples.
#[test]
fn a_sampled_law_takes_a_voltage() {
    let source = format!("{MOTOR}{}{STEP}", PLACED.replace("poles", "sample_time = \"0.1 ms\"\npoles"));
    let run = by(&source, Method::Automatic);
    near(at(&run, "rotor.phi", 0.2), 1.0, 1e-3, "it arrives");
    let volts = signal(&run, "V.v");
    assert!(volts.iter().any(|x| *x != 0.0));
}

/// Events ramp a current through a resistor beside an inductor, `v = L Σ Δa (1 − e^(−(t − t_k)/T))` over the corners of the current, T = L/R.
#[test]
fn events_set_a_current_source() {
    let source = "[current_source.I]\nfrom = \"ground\"\nto = \"n\"\n[resistor.R]\nfrom = \"n\"\nto = \"ground\"\nresistance = \"3 Ohm\"\n\
                  [inductor.L]\nfrom = \"n\"\nto = \"ground\"\ninductance = \"0.5 H\"\n\
                  [scenario]\nduration = \"4 s\"\noutput_step = \"10 ms\"\n\
                  [[scenario.event]]\nat = \"1 s\"\nsignal = \"I.i\"\nto = \"2 A\"\nover = \"500 ms\"\n\
                  [[scenario.event]]\nat = \"3 s\"\nsignal = \"I.i\"\nto = \"-1 A\"\nover = \"600 ms\"\n";
    let corners = [(1.0, 4.0), (1.5, -4.0), (3.0, -5.0), (3.6, 5.0)];
    let behind = |t: f64| corners.into_iter().filter(move |(at, _)| t > *at).map(move |(at, by)| (t - at, by));
    for method in METHODS {
        let run = by(source, method);
        for (k, t) in run.series.time.iter().enumerate() {
            let what = format!("{method:?} at {t}");
            let current: f64 = behind(*t).map(|(t, by)| by * t).sum();
            let volts: f64 = behind(*t).map(|(t, by)| 0.5 * by * (1.0 - (-6.0 * t).exp())).sum();
            near(signal(&run, "I.i")[k], current, 1e-11, &what);
            near(signal(&run, "I.v")[k], volts, 1e-8, &what);
            near(signal(&run, "I.q")[k], behind(*t).map(|(t, by)| 0.5 * by * t * t).sum(), 1e-11, &what);
        }
        assert!(run.energy.residual.abs() <= 1e-8 * run.energy.dissipated, "{method:?}: {:?}", run.energy);
    }
    let told = |source: String| {
        let mistakes = Project::open(&source).mistakes().to_vec();
        mistakes.iter().map(|one| format!("{}: {}", one.code, one.message)).collect::<Vec<_>>()
    };
    let steps = told(source.replace("over = \"500 ms\"\n", ""));
    assert!(
        steps.iter().any(|one| one.starts_with("motion::jump: `I.i` would jump from 0 to 2 A at 1 s")),
        "{steps:?}"
    );
    assert!(told(source.replace("at = \"1 s\"", "at = \"0 s\"").replace("over = \"500 ms\"\n", "")).is_empty());
    let given = told(source.replacen("to = \"n\"", "to = \"n\"\ncurrent = \"1 A\"", 1));
    assert!(given.iter().any(|one| one.contains("the current of `I` is what its `current` says")), "{given:?}");
    let dimension = told(source.replace("\"2 A\"", "\"2 V\""));
    assert!(dimension.iter().any(|one| one.starts_with("unit::dimension")), "{dimension:?}");
}
