//! Motors between circuits and shafts, sources of current and coupled coils, against closed forms.

use crate::common::*;
use kardan::diagnostics::Severity;
use kardan::num::{Matrix, Rational};
use kardan::reduce::linearise;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study::{self, AnalyzeSettings, EquationsForm, Silent};

const METHODS: [Method; 4] = [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau];

/// The integrators allow a relative 1e-10 per step; a run takes up to a hundred steps whose errors add at worst.
const ACCURATE: f64 = 1e-8;

/// All rows of a signal against a closed form over time, relative to its largest value.
#[track_caller]
fn follows(run: &Run, name: &str, closed: impl Fn(f64) -> f64) {
    follows_with_accuracy(ACCURATE, run, name, closed);
}

#[track_caller]
fn follows_with_accuracy(share: f64, run: &Run, name: &str, closed: impl Fn(f64) -> f64) {
    let expected: Vec<f64> = run.series.time.iter().map(|t| closed(*t)).collect();
    let size = expected.iter().fold(0.0f64, |max, x| max.max(x.abs()));
    assert!(expected.len() > 50 && size > 0.0);
    for ((time, value), expected) in run.series.time.iter().zip(signal(run, name)).zip(expected) {
        assert!((value - expected).abs() <= share * size, "{name} at {time} s: {value} against {expected}");
    }
}

fn scenario(duration: &str, step: &str, extra: &str) -> String {
    format!("[scenario]\nduration = \"{duration}\"\noutput_step = \"{step}\"\n{extra}\n")
}

const TWELVE_VOLTS: &str = "[[scenario.event]]\nat = \"0 s\"\nsignal = \"V.v\"\nto = \"12 V\"\n";

/// A motor at a source of voltage, with these more keys.
fn motor(keys: &str) -> String {
    format!(
        "[voltage_source.V]\nfrom = \"ground\"\nto = \"in\"\n[dc_motor.M]\nfrom = \"in\"\nto = \"ground\"\nshaft = \"rotor\"\n\
         torque_constant = \"0.05 N m/A\"\nresistance = \"0.8 Ohm\"\n{keys}\n[shaft.rotor]\ninertia = \"1e-4 kg m^2\"\n"
    )
}

/// The powers at both sides are one, row by row but for the rounding of what is read, and the energies close.
fn exchanges(run: &Run, name: &str, speed: impl Fn(usize) -> f64) {
    let read = |quantity: &str, row: usize| signal(run, &format!("{name}.{quantity}"))[row];
    let rows = 0..run.series.time.len();
    let powers: Vec<[f64; 2]> =
        rows.map(|row| [read("emf.v", row) * read("i", row), read("tau", row) * speed(row)]).collect();
    let largest = powers.iter().fold(0.0f64, |most, [power, _]| most.max(power.abs()));
    for [electric, mechanic] in powers {
        assert!((electric - mechanic).abs() <= 1e-12 * largest, "{electric} W and {mechanic} W");
    }
    assert!(run.energy.residual.abs() <= 1e-8 * run.energy.input, "{:?}", run.energy);
}

// ---- dc_motor -----------------------------------------------------------------------------------------------------

/// Without inductance: i = V/R e^(−t/T), ω = V/k (1 − e^(−t/T)), T = J R/k². At once it draws what it draws while it stands, V/R.
#[test]
fn a_motor_of_zero_inductance_runs_up_in_its_time_constant() {
    let source = motor("") + &scenario("0.2 s", "1 ms", TWELVE_VOLTS);
    let time = 1e-4 * 0.8 / (0.05 * 0.05);
    let falls = |t: f64| (-t / time).exp();
    for method in METHODS {
        let run = run_by(&source, method, None);
        follows(&run, "M.i", |t| 15.0 * falls(t));
        follows(&run, "V.i", |t| 15.0 * falls(t));
        follows(&run, "rotor.w", |t| 240.0 * (1.0 - falls(t)));
        follows(&run, "rotor.phi", |t| 240.0 * (t - time * (1.0 - falls(t))));
        follows(&run, "M.tau", |t| 0.75 * falls(t));
        follows(&run, "M.emf.v", |t| 12.0 * (1.0 - falls(t)));
        follows(&run, "M.v", |_| 12.0);
        exchanges(&run, "M", |row| signal(&run, "rotor.w")[row]);
        // Of what the source gives, one half is kept.
        close(run.energy.input, 12.0 * 15.0 * time * (1.0 - falls(0.2)), 1e-7, "V q");
    }
}

/// With inductance: the poles of L J s² + R J s + k², both real here.
#[test]
fn a_motor_with_inductance_has_two_poles() {
    let keys = "inductance = \"0.6 mH\"\nrotor_inertia = \"4e-6 kg m^2\"";
    let source = motor(keys) + &scenario("0.1 s", "1 ms", TWELVE_VOLTS);
    let (l, j, r, k) = (0.6e-3f64, 1.04e-4, 0.8, 0.05);
    let root = (r * r / (l * l) - 4.0 * k * k / (l * j)).sqrt();
    let [fast, slow] = [-0.5 * (r / l + root), -0.5 * (r / l - root)];
    for method in METHODS {
        let run = run_by(&source, method, None);
        // Between its steps DOP853 is less accurate.
        let share = if method == Method::Dop853 { 1e-7 } else { ACCURATE };
        follows_with_accuracy(share, &run, "rotor.w", |t| {
            240.0 * (1.0 + (slow * (fast * t).exp() - fast * (slow * t).exp()) / (fast - slow))
        });
        follows_with_accuracy(share, &run, "M.i", |t| 12.0 / l * ((fast * t).exp() - (slow * t).exp()) / (fast - slow));
        exchanges(&run, "M", |row| signal(&run, "rotor.w")[row]);
    }
}

/// Held still it is a coil: i = V/R (1 − e^(−Rt/L)), and the constraint takes k i. What the motor does to its stator is the opposite of what it
/// does to its rotor, against a car that rolls freely.
#[test]
fn a_locked_motor_and_one_on_a_car() {
    let locked = motor("inductance = \"4 mH\"")
        + "[constraint.hold]\ncoefficients = { rotor = 1 }\n[shaft.free]\ninertia = \"1 kg m^2\"\n";
    let run = run(&(locked + &scenario("50 ms", "0.5 ms", TWELVE_VOLTS)));
    let current = |t: f64| 15.0 * (1.0 - (-t * 200.0f64).exp());
    follows(&run, "M.i", current);
    follows(&run, "hold.tau", |t| -0.05 * current(t));
    assert!(signal(&run, "M.emf.v").iter().all(|v| *v == 0.0));
    let car = motor("reaction = \"car\"") + "[shaft.car]\ninertia = \"3e-4 kg m^2\"\n";
    let run = crate::common::run(&(car + &scenario("0.2 s", "1 ms", TWELVE_VOLTS)));
    // Against each other they have the inertia 1/(1/J1 + 1/J2).
    let time = 0.75e-4 * 0.8 / (0.05 * 0.05);
    follows(&run, "rotor.w", |t| 0.75 * 240.0 * (1.0 - (-t / time).exp()));
    follows(&run, "car.w", |t| -0.25 * 240.0 * (1.0 - (-t / time).exp()));
    exchanges(&run, "M", |row| signal(&run, "rotor.w")[row] - signal(&run, "car.w")[row]);
    // The ground, named, is no shaft.
    let named = crate::common::run(&(motor("reaction = \"ground\"") + &scenario("0.2 s", "1 ms", TWELVE_VOLTS)));
    let plain = crate::common::run(&(motor("") + &scenario("0.2 s", "1 ms", TWELVE_VOLTS)));
    assert_eq!(named.series, plain.series);
}

/// A voice coil: m, B l, R, with a spring: at rest V/R times B l stretches the spring; a constant in volts for each radian per second is one
/// in newton metres for each ampere, and one in volts for each turn per minute.
#[test]
fn a_voice_coil_and_constants_in_other_units() {
    let coil = "[voltage_source.V]\nfrom = \"ground\"\nto = \"in\"\n[dc_motor.coil]\nfrom = \"in\"\nto = \"ground\"\nmass = \"cone\"\n\
                torque_constant = \"7 N/A\"\nresistance = \"6 Ohm\"\nrotor_inertia = \"5 g\"\n[mass.cone]\nmass = \"15 g\"\n\
                [spring_damper.rim]\nmass_1 = \"cone\"\nstiffness = \"1000 N/m\"\ndamping = \"1 N s/m\"\n"
        .to_string();
    let source = coil + &scenario("0.5 s", "1 ms", TWELVE_VOLTS);
    let run = run(&source);
    close(at(&run, "coil.f", 0.5), 14.0, 1e-8, "force");
    close(at(&run, "cone.s", 0.5), 0.014, 1e-8, "where the spring holds it");
    close(signal(&run, "coil.i")[0], 2.0, 1e-12, "at once");
    let inertia = linearise(&first(&source).reduced, &[0.0; 2]).inertia;
    assert!(inertia.as_slice().contains(&Rational::from_parts(1.into(), 50u8.into())), "{inertia:?}");
    let constant = |text: &str| {
        let source = motor("").replace("0.05 N m/A", text) + &scenario("1 s", "1 ms", "");
        linearise(&first(&source).reduced, &[0.0; 2]).damping
    };
    assert_eq!(constant("0.05 V s/rad"), constant("50 mN m/A"));
    let [one, other] = [constant("0.05 V/rpm"), constant("0.05 V s/rad")];
    let ratio = one.to_f64()[(0, 1)] / other.to_f64()[(0, 1)];
    close(ratio, 30.0 / std::f64::consts::PI, 1e-15, "revolutions in a minute");
}

const EXACT: &str = "[voltage_source.V]\nfrom = \"ground\"\nto = \"in\"\n[dc_motor.M]\nfrom = \"in\"\nto = \"ground\"\nshaft = \"rotor\"\n\
                     torque_constant = \"2 N m/A\"\nresistance = \"1 Ohm\"\ninductance = \"0.5 H\"\n[shaft.rotor]\n\
                     inertia = \"0.25 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n";

/// L = 1/2, R = 1, k = 2, J = 1/4, d = 1/10: s² + (R/L + d/J) s + (R d + k²)/(L J) in fractions, and G = k/(L J)/(...) for the speed.
#[test]
fn the_linear_model_of_a_motor_is_exact() {
    let settings = AnalyzeSettings { outputs: vec!["rotor.w".into(), "M.i".into()], ..AnalyzeSettings::default() };
    let (linear, _) = study::linearise(EXACT, &settings, false).unwrap();
    let place = |name: &str| linear.states.iter().position(|state| state.name == name).unwrap();
    let (i, w) = (place("M.i"), place("rotor.w"));
    let entry = |row: usize, column: usize| linear.a[(row, column)].to_string();
    assert_eq!([entry(i, i), entry(i, w), entry(w, i), entry(w, w)], ["-2", "-4", "8", "-2/5"]);
    assert_eq!((linear.b[(i, 0)].to_string(), linear.b[(w, 0)].to_string()), ("2".into(), "0".into()));
    // G(3) = 16/(9 + 36/5 + 164/5) = 16/49 and (s + d/J)/L over the same.
    let n = linear.states.len();
    let resolvent = Matrix::from_fn(n, n, |row, column| {
        let own = if row == column { Rational::from(3) } else { Rational::ZERO };
        own - &linear.a[(row, column)]
    });
    let found = linear.c.multiply(&resolvent.solve(&linear.b).unwrap());
    assert_eq!([found[(0, 0)].to_string(), found[(1, 0)].to_string()], ["16/49", "34/245"]);
}

/// Of the states one is missing to be reached: J ω + d φ − k q stays. Nothing in the class speaks against a linear model but that the source has
/// no inductance; the least number of motors and the modes are those of the coupled system.
#[test]
fn the_structure_of_a_motor_is_decided_exactly() {
    let found = study::analyze(EXACT, &AnalyzeSettings::default(), &Silent).unwrap();
    let polynomials: Vec<&str> = found.structure.factors.iter().map(|one| one.polynomial.as_str()).collect();
    assert!(polynomials.contains(&"s^2 + 12/5 s + 164/5"), "{polynomials:?}");
    assert_eq!((found.structure.controllable_rank, found.structure.states.len()), (3, 4));
    let class = found.class.unwrap();
    let broken: Vec<&str> =
        class.assumptions.iter().filter(|one| !one.satisfied).map(|one| one.statement.as_str()).collect();
    assert!(broken.len() == 1 && broken[0].contains("inertia"), "{broken:?}");
    // Without inductance the current is no state: T = J R/(k² + R d).
    let quick = EXACT.replace("inductance = \"0.5 H\"\n", "");
    let settings = AnalyzeSettings::default();
    let found = study::analyze(&quick, &settings, &Silent).unwrap();
    let polynomials: Vec<&str> = found.structure.factors.iter().map(|one| one.polynomial.as_str()).collect();
    assert!(polynomials.contains(&"s + 82/5"), "{polynomials:?}");
}

/// The equations have each torque once: what is linear in the matrices, what is not on the right.
#[test]
fn equations_have_linear_laws_in_their_matrices() {
    let laws = "[torque.drag]\nshaft = \"rotor\"\nlaw = \"-3 N m s/rad * rotor.w\"\n[torque.weight]\nshaft = \"rotor\"\n\
                law = \"-5 N m * sin(rotor.phi)\"\n";
    let source = EXACT.to_string() + laws + "[analysis]\nat = { \"rotor.phi\" = \"0 deg\" }\n";
    let (text, _) = study::equations(&source, EquationsForm::Text).unwrap();
    for line in ["0.5 M'' + M' + 2 rotor' = V.v", "0.25 rotor'' - 2 M' + 3.1 rotor' = weight.tau"] {
        assert!(text.contains(line), "{line} in\n{text}");
    }
}

/// A generator with a motor behind it: the circuit connects their shafts. At rest all torques and voltages are in balance.
#[test]
fn a_circuit_connects_shafts() {
    let machine = |name: &str, constant: &str| {
        format!(
            "[dc_motor.{name}]\nfrom = \"line\"\nto = \"ground\"\nshaft = \"s_{name}\"\ntorque_constant = \"{constant}\"\n\
             resistance = \"0.2 Ohm\"\n[shaft.s_{name}]\ninertia = \"1e-3 kg m^2\"\ndamping = \"1e-3 N m s/rad\"\n"
        )
    };
    let source = machine("dynamo", "0.1 V s/rad")
        + &machine("drive", "0.2 N m/A")
        + "[motor.diesel]\nshaft = \"s_dynamo\"\n"
        + &scenario("100 s", "100 ms", "[[scenario.event]]\nat = \"0 s\"\nsignal = \"diesel.tau\"\nto = \"1 N m\"\n");
    let (_, reported) = study::prepare(&source);
    assert!(
        reported.iter().all(|one| one.severity != Severity::Error && one.code != "model::disconnected"),
        "{reported:?}"
    );
    let run = run(&source);
    let end = |name: &str| at(&run, name, 100.0);
    close(end("drive.i"), -end("dynamo.i"), 1e-12, "one current");
    close(1.0 - 0.1 * end("drive.i"), 1e-3 * end("s_dynamo.w"), 1e-8, "of the diesel");
    close(0.2 * end("drive.i"), 1e-3 * end("s_drive.w"), 1e-8, "of the drive");
    close(0.1 * end("s_dynamo.w"), 0.2 * end("s_drive.w") + 0.4 * end("drive.i"), 1e-8, "of the line");
    assert!(run.energy.residual.abs() <= 1e-8 * run.energy.input, "{:?}", run.energy);
}

/// Laws that bend act beside motions without inertia where these do not feel them; where they do they are refused by name.
#[test]
fn nonlinear_laws_may_act_beside_massless_motions() {
    let weight = "[torque.weight]\nshaft = \"rotor\"\nlaw = \"-0.4 N m * sin(rotor.phi)\"\n";
    let source = motor("") + weight + &scenario("2 s", "1 ms", TWELVE_VOLTS.replace("12 V", "0.4 V").as_str());
    for method in METHODS {
        // It hangs where k V/R holds it.
        let angle = at(&run_by(&source, method, None), "rotor.phi", 2.0);
        close(0.4 * angle.sin(), 0.05 * 0.5, 1e-8, "balance");
    }
    let felt = "[torque.odd]\nshaft = \"rotor\"\nlaw = \"1 N m/A^2 * M.i * M.i\"\n";
    let (_, reported) = study::prepare(&(motor("") + felt + &scenario("2 s", "1 ms", "")));
    let reported: Vec<_> = reported.iter().filter(|one| one.severity == Severity::Error).collect();
    assert!(reported.len() == 1 && reported[0].message.contains("laws (`odd`)"), "{reported:?}");
}

// ---- current_source -----------------------------------------------------------------------------------------------

fn feed(current: &str) -> String {
    format!(
        "[current_source.I]\nfrom = \"ground\"\nto = \"n\"\ncurrent = \"{current}\"\n[resistor.R]\nfrom = \"n\"\nto = \"ground\"\n\
         resistance = \"10 Ohm\"\n"
    )
}

const CAPACITOR: &str = "[capacitor.C]\nfrom = \"n\"\nto = \"ground\"\ncapacitance = \"100 uF\"\n";

/// Into R beside C, from rest: v = R I (1 − e^(−t/T)) of a constant current; of I sin ωt what solves T v' + v = R I sin ωt.
#[test]
fn a_current_into_a_resistor_and_a_capacitor() {
    let (time, omega) = (1e-3, 2.0 * std::f64::consts::PI * 50.0);
    for method in METHODS {
        let run = run_by(&(feed("2 A") + CAPACITOR + &scenario("5 ms", "50 us", "")), method, None);
        follows(&run, "I.v", |t| 20.0 * (1.0 - (-t / time).exp()));
        follows(&run, "R.i", |t| 2.0 * (1.0 - (-t / time).exp()));
        follows(&run, "C.i", |t| 2.0 * (-t / time).exp());
        follows(&run, "I.q", |t| 2.0 * t);
        let supplied = 40.0 * (5e-3 - time * (1.0 - (-5.0f64).exp()));
        close(run.energy.input / supplied, 1.0, ACCURATE, "v i is what the source gives");
        let source = feed("2 A * sin(2 pi * 50 Hz * t)") + CAPACITOR + &scenario("40 ms", "0.5 ms", "");
        let run = run_by(&source, method, None);
        let size = 20.0 / (1.0 + omega * omega * time * time);
        let closed =
            |t: f64| size * ((omega * t).sin() - omega * time * (omega * t).cos() + omega * time * (-t / time).exp());
        follows(&run, "n.v", closed);
        assert!(run.energy.residual.abs() <= 1e-8 * run.energy.input, "{:?}", run.energy);
    }
}

/// What no integral is known of is kept: a current t sin ωt through a coil takes L di/dt and R i.
#[test]
fn a_current_of_unknown_integral_is_enforced_by_a_multiplier() {
    let source = "[current_source.I]\nfrom = \"ground\"\nto = \"n\"\ncurrent = \"2 A/s * t * sin(100 rad/s * t)\"\n[resistor.R]\n\
                  from = \"n\"\nto = \"m\"\nresistance = \"10 Ohm\"\n[inductor.L]\nfrom = \"m\"\nto = \"ground\"\ninductance = \"50 mH\"\n\
                  [inductor.L2]\nfrom = \"m\"\nto = \"ground\"\ninductance = \"50 mH\"\n"
        .to_string()
        + &scenario("0.2 s", "1 ms", "");
    let run = run(&source);
    let current = |t: f64| 2.0 * t * (100.0 * t).sin();
    follows(&run, "I.i", current);
    follows(&run, "L.i", |t| 0.5 * current(t));
    let rate = |t: f64| 2.0 * (100.0 * t).sin() + 200.0 * t * (100.0 * t).cos();
    follows(&run, "I.v", |t| 10.0 * current(t) + 25e-3 * rate(t));
}

/// A damper behind a prescribed motion, and a spring: d (v − ẋ) = s x.
#[test]
fn a_massless_motion_follows_a_prescribed_one() {
    let source =
        "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\n[prescribed_motion.p]\nshaft = \"a\"\nangle = \"3 rad/s * t\"\n\
                  [spring_damper.d]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\ndamping = \"2 N m s/rad\"\n\
                  [spring_damper.s]\nshaft_1 = \"b\"\nstiffness = \"4 N m/rad\"\n"
            .to_string()
            + &scenario("3 s", "30 ms", "");
    for method in METHODS {
        let run = run_by(&source, method, None);
        follows(&run, "b.phi", |t| 1.5 * (1.0 - (-2.0 * t).exp()));
        follows(&run, "b.w", |t| 3.0 * (-2.0 * t).exp());
        follows(&run, "p.tau", |t| 6.0 * (1.0 - (-2.0 * t).exp()));
        assert!(run.energy.residual.abs() <= 1e-8 * run.energy.input, "{:?}", run.energy);
    }
}

// ---- coupled_inductors --------------------------------------------------------------------------------------------

fn coupled(how: &str) -> String {
    format!(
        "[coupled_inductors.T]\nfrom_1 = \"a\"\nto_1 = \"ground\"\nfrom_2 = \"b\"\nto_2 = \"ground\"\ninductance_1 = \"2 mH\"\n\
         inductance_2 = \"8 mH\"\n{how}\n[capacitor.C1]\nfrom = \"a\"\nto = \"ground\"\ncapacitance = \"4 uF\"\n\
         initial_voltage = \"1 V\"\n[capacitor.C2]\nfrom = \"b\"\nto = \"ground\"\ncapacitance = \"1 uF\"\n"
    )
}

/// Two equal circuits, ω² = 1/LC each: coupled by k they ring with ω/√(1 ± k), and what is in one goes to the other and back.
#[test]
fn two_coupled_circuits_beat() {
    let omega = 1.0 / (2e-3 * 4e-6f64).sqrt();
    for (how, k) in [("mutual_inductance = \"1 mH\"", 0.25f64), ("coupling = \"-1/2\"", -0.5)] {
        let run = run(&(coupled(how) + &scenario("2 ms", "10 us", "")));
        let [slow, fast] = [omega / (1.0 + k).sqrt(), omega / (1.0 - k).sqrt()];
        follows(&run, "C1.v", |t| 0.5 * ((slow * t).cos() + (fast * t).cos()));
        // By n = √(L2/L1) = 2 the second voltage is larger.
        follows(&run, "C2.v", |t| (slow * t).cos() - (fast * t).cos());
        let [one, two] = ["T.1", "T.2"].map(|winding| signal(&run, &format!("{winding}.i")));
        let [c1, c2] = ["C1.v", "C2.v"].map(|name| signal(&run, name));
        let mutual = k * 4e-3;
        for row in 0..run.series.time.len() {
            let coils = 1e-3 * one[row] * one[row] + 4e-3 * two[row] * two[row] + mutual * one[row] * two[row];
            let plates = 2e-6 * c1[row] * c1[row] + 0.5e-6 * c2[row] * c2[row];
            close(coils + plates, 2e-6, 1e-8 * 2e-6, "the energy stays");
        }
    }
}

/// The matrix of the windings is L1, M, M, L2 as they are given, and M = k √(L1 L2) without rounding where the root is a fraction.
#[test]
fn the_matrix_of_coupled_coils_is_exact() {
    let matrix =
        |how: &str| linearise(&first(&(coupled(how) + &scenario("1 s", "1 ms", ""))).reduced, &[0.0; 2]).inertia;
    let thousandths = |n: i64| Rational::from(n) / Rational::from(1000);
    let expected = Matrix::from_fn(2, 2, |i, j| thousandths(if i == j { [2, 8][i] } else { 1 }));
    assert_eq!(matrix("mutual_inductance = \"1 mH\""), expected);
    assert_eq!(matrix("coupling = 0.25"), expected);
}
