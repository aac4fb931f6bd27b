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
    let coefficients = [250.0, 26_400.0, 820_000.0];
    let [current, angle, speed] = gains(coefficients);
    let design = Project::open(format!("{MOTOR}{PLACED}{STEP}"))
        .design(&DesignSettings::default(), &Silent)
        .unwrap_or_else(|reported| panic!("{reported:?}"));
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
    // What it limits is a voltage, wherever that is told.
    let limit_exit = "V leaves its voltage limit";
    assert!(run.events.iter().any(|event| event.description == limit_exit), "{:?}", run.events);
    let requirement = "[[requirement]]\nsignal = \"V.command\"\nmeasure = \"time_at_limit\"\nbelow = \"1 ms\"\n";
    let run = by(&format!("{source}{requirement}"), Method::Automatic);
    assert_eq!(run.requirements[0].text, "time of V at its voltage limit < 0.001 s");
    let until = run.events.iter().find(|event| event.description == limit_exit).expect("it leaves").time;
    near(run.requirements[0].measured.expect("measured"), until, 1e-12, "time at the limit");
}

/// Every law that takes inputs takes voltages: what of the loop is asked for holds.
#[test]
fn other_laws_take_voltages() {
    let laws = [
        "law = \"lqr\"\ninputs = [\"V\"]\nmax_acceptable = { V = \"10 V\" }\n",
        "law = \"decoupling\"\ninputs = [\"V\"]\n",
    ];
    for law in laws {
        let channels = "[[control.servo.channels]]\noutput = \"rotor.phi\"\nreference = \"wanted\"\n";
        let own = if law.contains("decoupling") { "poles = [-50, \"-100 ± 80j\"]\n" } else { "" };
        let source = format!("{MOTOR}[control.servo]\n{law}{channels}{own}{STEP}").replace("0.2 s", "1 s");
        let run = Project::open(&source)
            .run(&runs_only(), &Silent)
            .unwrap_or_else(|reported| panic!("{reported:?}\n{source}"))
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
    let reported = |source: String| {
        let diagnostics = Project::open(&source).diagnostics().to_vec();
        diagnostics.iter().map(|one| format!("{}: {}", one.code, one.message)).collect::<Vec<_>>()
    };
    let steps = reported(source.replace("over = \"500 ms\"\n", ""));
    assert!(
        steps.iter().any(|one| one.starts_with("motion::discontinuous: `I.i` would jump from 0 to 2 A at 1 s")),
        "{steps:?}"
    );
    assert!(reported(source.replace("at = \"1 s\"", "at = \"0 s\"").replace("over = \"500 ms\"\n", "")).is_empty());
    let prescribed = reported(source.replacen("to = \"n\"", "to = \"n\"\ncurrent = \"1 A\"", 1));
    assert!(prescribed.iter().any(|one| one.contains("the `current` of `I` prescribes its current")), "{prescribed:?}");
    let dimension = reported(source.replace("\"2 A\"", "\"2 V\""));
    assert!(dimension.iter().any(|one| one.starts_with("unit::dimension")), "{dimension:?}");
}

/// Pulses of a current into a resistor beside a capacitor, where nothing has an inductance: the current of the resistor follows `T i′ = I − i`, T = RC. So
/// do steps by events; with an inductance they are refused.
#[test]
fn a_current_jumps_where_nothing_has_an_inductance() {
    let source = "[current_source.I]\nfrom = \"ground\"\nto = \"n\"\ncurrent = \"p\"\n[resistor.R]\nfrom = \"n\"\nto = \"ground\"\nresistance = \"10 Ohm\"\n\
                  [capacitor.C]\nfrom = \"n\"\nto = \"ground\"\ncapacitance = \"1 mF\"\n\
                  [signal.p]\nkind = \"pulses\"\nhigh = \"1 A\"\nperiod = \"0.1 s\"\nwidth = \"0.05 s\"\n[scenario]\nduration = \"0.19 s\"\n";
    let events = source.replace("current = \"p\"\n", "").replace(
        "duration",
        "event = [{ at = \"0 s\", signal = \"I.i\", to = \"1 A\" }, { at = \"0.05 s\", signal = \"I.i\", to = \"0 A\" }, \
         { at = \"0.1 s\", signal = \"I.i\", to = \"1 A\" }, { at = \"0.15 s\", signal = \"I.i\", to = \"0 A\" }]\nduration",
    );
    let behind =
        |t: f64| (0..4).map(move |k| (t - 0.05 * f64::from(k), 1.0 - 2.0 * f64::from(k % 2))).filter(|(t, _)| *t > 0.0);
    for (source, method) in METHODS.iter().flat_map(|method| [(source, *method), (&events, *method)]) {
        let run = by(source, method);
        for (k, t) in run.series.time.iter().enumerate() {
            let current: f64 = behind(*t).map(|(t, by)| by * (1.0 - (-t / 0.01).exp())).sum();
            near(signal(&run, "R.i")[k], current, 1e-8, &format!("{method:?} at {t}"));
        }
        assert!(run.energy.residual_share().is_some_and(|part| part < 1e-8), "{method:?}: {:?}", run.energy);
    }
    let inductor = "[inductor.L]\nfrom = \"n\"\nto = \"ground\"\ninductance = \"1 mH\"\n[scenario]";
    let diagnostics = Project::open(source.replace("[scenario]", inductor)).diagnostics().to_vec();
    let message = "it jumps by -1 A at 0.05 s, which needs an infinite voltage of an inductance";
    assert!(diagnostics.iter().any(|one| one.message.contains(message)), "{diagnostics:?}");
}

/// `ẋ = A x + B` from x(0), by the exponential of `A t`: its series, halved until it is short, then squared.
fn moved(a: &[Vec<f64>], b: &[f64], start: &[f64], t: f64) -> Vec<f64> {
    let n = a.len() + 1;
    let entry = |i: usize, j: usize| match (i + 1 < n, j + 1 < n) {
        (true, true) => a[i][j],
        (true, false) => b[i],
        _ => 0.0,
    };
    let halved = 24;
    let small = t / f64::from(1 << halved);
    let product = |x: &[f64], y: &[f64]| -> Vec<f64> {
        (0..n * n).map(|k| (0..n).map(|l| x[k / n * n + l] * y[l * n + k % n]).sum()).collect()
    };
    let step: Vec<f64> = (0..n * n).map(|k| small * entry(k / n, k % n)).collect();
    // e^x − 1, so that the halves lose no digits: (e^x − 1)(e^x − 1) + 2 (e^x − 1).
    let mut power = step.clone();
    let mut all = step.clone();
    for k in 2..8 {
        power = product(&power, &step).iter().map(|x| x / f64::from(k)).collect();
        all.iter_mut().zip(&power).for_each(|(sum, x)| *sum += x);
    }
    for _ in 0..halved {
        let square = product(&all, &all);
        all.iter_mut().zip(square).for_each(|(x, square)| *x = 2.0 * *x + square);
    }
    let from: Vec<f64> = start.iter().copied().chain([1.0]).collect();
    (0..n - 1).map(|i| from[i] + (0..n).map(|j| all[i * n + j] * from[j]).sum::<f64>()).collect()
}

const OBSERVED: &str =
    "[control.servo.observer]\nsensors = [\"rotor.phi\"]\ndisturbances = []\npoles = [-300, \"-250 ± 100j\"]\n";

/// An observer of a motor with inductance estimates speed and current from the angle: its gain gives (s + 300) (s² + 500 s + 72500), and
/// the loop of plant and observer moves as its six equations say. What has flowed through the winding is no state of it.
#[test]
fn an_observer_estimates_the_current_of_a_motor() {
    let (l, r, k, j, d) = (2e-3, 0.8, 0.05, 1e-4, 1e-5);
    let (a, b, c, e) = (d / j, k / j, k / l, r / l);
    let [c2, c1, c0] = [800.0, 222_500.0, 21_750_000.0];
    let angle = c2 - a - e;
    let speed = c1 - angle * (a + e) - (a * e + b * c);
    let current = (c0 - angle * (a * e + b * c) - speed * e) / b;
    let initial = "initial = { \"rotor.w\" = \"20 rad/s\" }\n";
    let source = format!("{MOTOR}{PLACED}{OBSERVED}{}", STEP.replace("[[scenario", &format!("{initial}[[scenario")));
    let design = Project::open(&source)
        .design(&DesignSettings::default(), &Silent)
        .unwrap_or_else(|reported| panic!("{reported:?}"));
    let observer = design.observer.as_ref().expect("an observer");
    assert_eq!(observer.states.len(), 3, "{:?}", observer.states);
    for (name, expected) in [("rotor.phi", angle), ("rotor.w", speed), ("M.i", current)] {
        let own = |state: &String| state == name || name == "M.i" && state == "V.i";
        let row = observer.states.iter().position(own).unwrap_or_else(|| panic!("{name} in {:?}", observer.states));
        near(observer.gain.values[row][0], expected, 1e-9 * expected.abs(), name);
    }
    let mut poles: Vec<[f64; 2]> = observer.poles.iter().map(|pole| [pole.re, pole.im]).collect();
    poles.sort_by(|a, b| a[1].total_cmp(&b[1]));
    for ([re, im], expected) in poles.iter().zip([[-250.0, -100.0], [-300.0, 0.0], [-250.0, 100.0]]) {
        near(*re, expected[0], 1e-9, "re");
        near(*im, expected[1], 1e-9, "im");
    }
    // x = [φ, w, i], then estimates; u = −K_φ φ − K_w ŵ − K_i î + K_φ r.
    let [of_current, of_angle, of_speed] = gains([250.0, 26_400.0, 820_000.0]);
    let command = [-of_angle, 0.0, 0.0, 0.0, -of_speed, -of_current];
    let mut whole = vec![vec![0.0; 6]; 6];
    for first in [0, 3] {
        whole[first][first + 1] = 1.0;
        (whole[first + 1][first + 1], whole[first + 1][first + 2]) = (-a, b);
        (whole[first + 2][first + 1], whole[first + 2][first + 2]) = (-c, -e);
        (0..6).for_each(|column| whole[first + 2][column] += command[column] / l);
    }
    for (row, gain) in [angle, speed, current].into_iter().enumerate() {
        whole[3 + row][0] += gain;
        whole[3 + row][3] -= gain;
    }
    let drive = [0.0, 0.0, of_angle / l, 0.0, 0.0, of_angle / l];
    for method in METHODS {
        let run = by(&source, method);
        for t in [0.002, 0.01, 0.03, 0.1, 0.2] {
            let expected = moved(&whole, &drive, &[0.0, 20.0, 0.0, 0.0, 0.0, 0.0], t);
            let what = format!("{method:?} at {t}");
            near(at(&run, "rotor.phi", t), expected[0], 1e-8, &what);
            near(at(&run, "M.i", t), expected[2], 1e-7, &what);
        }
    }
}

/// From rest an observer knows all, whatever its sensors: the loop moves as under the true state. A current is measured as it is.
#[test]
fn an_observer_that_starts_right_changes_nothing() {
    let plain = by(&format!("{MOTOR}{PLACED}{STEP}"), Method::Automatic);
    let with_current = OBSERVED.replace("\"rotor.phi\"", "\"rotor.phi\", \"M.i\"").replace("\"-250 ± 100j\"", "-400");
    for observer in [OBSERVED, &with_current] {
        for clock in ["", "sample_time = \"20 us\"\n"] {
            let placed = PLACED.replace("poles", &format!("{clock}poles"));
            let run = by(&format!("{MOTOR}{placed}{observer}{STEP}"), Method::Automatic);
            // Sampled the command is 20 us late in the mean by half: 1e-5 s times the largest speed of the step, 10 rad/s.
            let tolerance = if clock.is_empty() { 1e-8 } else { 3e-4 };
            for t in [0.005, 0.02, 0.05, 0.2] {
                near(
                    at(&run, "rotor.phi", t),
                    at(&plain, "rotor.phi", t),
                    tolerance,
                    &format!("{observer}{clock} at {t}"),
                );
            }
        }
    }
}

/// A load that nobody measured is estimated and cancelled: the angle comes back to what was asked for.
#[test]
fn an_observer_cancels_a_load_of_a_motor_with_inductance() {
    let load = "[disturbance.load]\nshaft = \"rotor\"\n";
    let event = "[[scenario.event]]\nat = \"0.3 s\"\nsignal = \"load\"\nto = \"0.05 N m\"\n";
    let source = |observer: &str| format!("{MOTOR}{load}{PLACED}{observer}{}{event}", STEP.replace("0.2 s", "1 s"));
    let poles = OBSERVED.replace("disturbances = []\n", "").replace("[-300, ", "[-300, -350, ");
    let kalman = "[control.servo.observer]\nsensors = [\"rotor.phi\"]\nmethod = \"kalman\"\n";
    for observer in [poles.as_str(), kalman] {
        let run = by(&source(observer), Method::Automatic);
        near(at(&run, "rotor.phi", 1.0), 1.0, 1e-6, observer);
    }
    // Without: τ R/k over the gain of the angle stays.
    let plain = by(&source(""), Method::Automatic);
    let [current, angle, _] = gains([250.0, 26_400.0, 820_000.0]);
    near(at(&plain, "rotor.phi", 1.0), 1.0 + 0.05 * (0.8 + current) / (0.05 * angle), 1e-6, "without");
}

/// `flatness` plans angle, current and voltage of a motor with inductance: the angle is 216000/(s + 60)³ of its reference, and the voltage
/// what the model takes for that.
#[test]
fn a_flat_trajectory_of_a_motor_with_inductance() {
    let (l, r, k, j, d) = (2e-3, 0.8, 0.05, 1e-4, 1e-5);
    let law = "[control.servo]\nlaw = \"flatness\"\ninputs = [\"V\"]\npoles = [-150, \"-200 ± 80j\"]\n[[control.servo.channels]]\n\
               output = \"rotor.phi\"\nreference = \"wanted\"\ncrossover_frequency = \"60 rad/s\"\n";
    let source = format!("{MOTOR}{law}{STEP}");
    let volts = |t: f64| {
        let decay = 216_000.0 * (-60.0 * t).exp();
        let (speed, rate, jerk) =
            (decay * t * t / 2.0, decay * (t - 30.0 * t * t), decay * (1.0 - 120.0 * t + 1800.0 * t * t));
        let (current, change) = ((j * rate + d * speed) / k, (j * jerk + d * rate) / k);
        l * change + r * current + k * speed
    };
    for method in METHODS {
        let run = by(&source, method);
        for t in [0.005, 0.02, 0.05, 0.2] {
            let what = format!("{method:?} at {t}");
            near(at(&run, "rotor.phi", t), 1.0 - (-60.0 * t).exp() * (1.0 + 60.0 * t + 1800.0 * t * t), 1e-8, &what);
            near(at(&run, "V.v", t), volts(t), 1e-6, &what);
        }
    }
    let design = Project::open(&source)
        .design(&DesignSettings::default(), &Silent)
        .unwrap_or_else(|reported| panic!("{reported:?}"));
    assert!(design.flatness.is_some_and(|found| found.flat));
    assert_eq!((design.states.len(), design.integrals_without_effect.len()), (3, 1), "{:?}", design.states);
}

/// A charge that only counts is a pole exactly at zero which is told in words, whatever found the gains; a capacitor's charge is a state, and
/// one that no sensor shows is named as a charge.
#[test]
fn charges_that_only_count_are_reported() {
    let channel = "[[control.servo.channels]]\noutput = \"rotor.phi\"\nreference = \"wanted\"\n";
    for law in [
        "law = \"lqr\"\ninputs = [\"V\"]\nmax_acceptable = { \"rotor.phi\" = \"0.1 rad\" }\n".to_string(),
        format!("law = \"decoupling\"\ninputs = [\"V\"]\n{channel}"),
    ] {
        let source = format!("{MOTOR}[control.servo]\n{law}[scenario]\nduration = \"0.1 s\"\n");
        let design = Project::open(&source)
            .design(&DesignSettings::default(), &Silent)
            .unwrap_or_else(|reported| panic!("{reported:?}"));
        assert!(
            matches!(design.integrals_without_effect.as_slice(), [one] if one.ends_with(".q")),
            "{law}: {:?}",
            design.integrals_without_effect
        );
        assert!(design.closed_loop_poles.iter().all(|pole| pole.re < 0.0), "{law}: {:?}", design.closed_loop_poles);
        let margins = design.margins.as_ref().expect("margins");
        assert!(margins.uncontrolled_are_integrals && margins.uncontrolled_poles == 1, "{law}: {}", margins.verdict);
    }
    let beside = "[voltage_source.U]\nfrom = \"ground\"\nto = \"x\"\n[inductor.L]\nfrom = \"x\"\nto = \"y\"\ninductance = \"1 mH\"\n\
                  [resistor.R]\nfrom = \"y\"\nto = \"z\"\nresistance = \"3 Ohm\"\n[capacitor.C]\nfrom = \"z\"\nto = \"ground\"\ncapacitance = \"0.5 mF\"\n";
    let source = format!("{MOTOR}{beside}{}{OBSERVED}{STEP}", PLACED.replace("-50, ", "-50, -1000, -2000, "));
    let reported =
        Project::open(&source).design(&DesignSettings::default(), &Silent).expect_err("no sensor shows the capacitor");
    let text = format!("{reported:?}");
    assert!(
        text.contains("L.q") && text.contains("observer") && !text.contains("C.phi") && !text.contains("M.phi"),
        "{text}"
    );
}
