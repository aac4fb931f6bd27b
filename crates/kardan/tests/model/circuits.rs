//! Circuits: closed forms, the analogy to drivetrains, and runs of ngspice.
//!
//! Origin of `golden/rlc_ladder.csv` and `golden/rlc_transformer.csv`: ngspice 39.3 (Debian package `ngspice`
//! 39.3+ds-1) with the netlist of the same name beside each, `ngspice -b FILE.cir`, trapezoidal rule with steps of at most
//! 2 ns, reltol 1e-9, abstol 1e-15 A, vntol 1e-12 V, started from zero with the source already on; every 10 us, ten digits.
//! Its error is that of the trapezoidal rule, of second order: from 8 ns to 4 ns its results change by 1.5e-8 V and
//! 3.4e-10 A at most, from 4 ns to 2 ns by 3.8e-9 V and 8.4e-11 A, a quarter of it as they should, so that those stored
//! are right to a third of that, 1.3e-9 V and 2.8e-11 A.

use crate::common::*;
use kardan::results::{Physical, Run};
use kardan::{model, study};

/// The integrator allows a relative 1e-10 per step; a run takes some hundred steps.
const ACCURATE: f64 = 1e-8;

fn element(kind: &str, name: &str, from: &str, to: &str, value: &str) -> String {
    format!("[{kind}.{name}]\nfrom = \"{from}\"\nto = \"{to}\"\n{value}\n")
}

fn inductor(name: &str, from: &str, to: &str, value: &str) -> String {
    element("inductor", name, from, to, &format!("inductance = \"{value}\""))
}

fn resistor(name: &str, from: &str, to: &str, value: &str) -> String {
    element("resistor", name, from, to, &format!("resistance = \"{value}\""))
}

fn capacitor(name: &str, from: &str, to: &str, value: &str) -> String {
    element("capacitor", name, from, to, &format!("capacitance = \"{value}\""))
}

fn source(name: &str, from: &str, to: &str) -> String {
    element("voltage_source", name, from, to, "")
}

fn transformer(name: &str, [from_1, to_1, from_2, to_2]: [&str; 4], ratio: &str) -> String {
    format!(
        "[transformer.{name}]\nfrom_1 = \"{from_1}\"\nto_1 = \"{to_1}\"\nfrom_2 = \"{from_2}\"\nto_2 = \"{to_2}\"\n\
         ratio = \"{ratio}\"\n"
    )
}

fn scenario(duration: &str, step: &str, extra: &str) -> String {
    format!("[scenario]\nduration = \"{duration}\"\noutput_step = \"{step}\"\n{extra}\n")
}

fn event(at: &str, signal: &str, to: &str) -> String {
    format!("[[scenario.event]]\nat = \"{at}\"\nsignal = \"{signal}\"\nto = \"{to}\"\n")
}

/// All rows of a signal against a closed form over time, relative to its largest value.
#[track_caller]
fn follows(run: &Run, name: &str, closed: impl Fn(f64) -> f64) {
    let values = signal(run, name);
    let expected: Vec<f64> = run.series.time.iter().map(|t| closed(*t)).collect();
    let size = expected.iter().fold(0.0f64, |max, x| max.max(x.abs()));
    assert!(values.len() > 100 && size > 0.0);
    for ((time, value), expected) in run.series.time.iter().zip(values).zip(expected) {
        assert!((value - expected).abs() <= ACCURATE * size, "{name} at {time} s: {value} against {expected}");
    }
}

// ---- closed forms -------------------------------------------------------------------------------------------------

/// ```text
///   +--( u )--[ R ]--UUUU L--+      q = C u (1 − e^(−δt) (cos ωt + δ/ω sin ωt))
///   |                        |      δ = R/2L, ω² = 1/LC − δ²
///   +-----------| |----------+
/// ```
/// From microfarads to farads: the accuracy does not depend on the size of the charges.
#[test]
fn step_response_of_an_rlc_loop() {
    for (r, l, c, duration) in [(10.0_f64, 1e-3, 1e-6, 2e-3), (0.1, 1e-6, 1e-9, 2e-5), (0.5, 2.0, 0.5, 30.0)] {
        let text = source("V", "ground", "a")
            + &resistor("R", "a", "b", &format!("{r} Ohm"))
            + &inductor("L", "b", "c", &format!("{l} H"))
            + &capacitor("C", "c", "ground", &format!("{c} F"))
            + &scenario(&format!("{duration} s"), &format!("{} s", duration / 500.0), "")
            + &event("0 s", "V.v", "12 V");
        let run = run(&text);
        let delta = r / (2.0 * l);
        let omega = (1.0 / (l * c) - delta * delta).sqrt();
        let wave = |t: f64| (-delta * t).exp() * ((omega * t).cos() + delta / omega * (omega * t).sin());
        let charge = |t: f64| 12.0 * c * (1.0 - wave(t));
        let current = |t: f64| 12.0 / (l * omega) * (-delta * t).exp() * (omega * t).sin();
        let change = |t: f64| (12.0 - r * current(t) - charge(t) / c) / l;
        for name in ["V", "R", "L", "C"] {
            follows(&run, &format!("{name}.q"), charge);
            follows(&run, &format!("{name}.i"), current);
        }
        follows(&run, "R.v", |t| r * current(t));
        follows(&run, "C.v", |t| charge(t) / c);
        follows(&run, "L.v", |t| l * change(t));
        follows(&run, "V.v", |_| 12.0);
        // Potentials: the multipliers of Kirchhoff's current law.
        follows(&run, "a.v", |_| 12.0);
        follows(&run, "b.v", |t| 12.0 - r * current(t));
        follows(&run, "c.v", |t| charge(t) / c);
        let end = charge(duration);
        close(run.energy.input / (12.0 * end), 1.0, ACCURATE, "the source gives u q");
        assert!(run.energy.residual.abs() <= 1e-8 * run.energy.input, "{:?}", run.energy);
        let kinds: Vec<_> = ["L.q", "L.i", "L.v"].iter().map(|s| run.series.signal(s).unwrap().physical).collect();
        assert_eq!(kinds, [Physical::Charge, Physical::Current, Physical::Voltage]);
        assert_eq!(kinds.iter().map(|kind| kind.unit()).collect::<Vec<_>>(), ["C", "A", "V"]);
    }
}

/// ```text
///   +--( u )--[ R1 ]--UUUU L1--+  n:1  +--[ R2 ]--UUUU L2--+
///   |                          ) || (                     |     i = u/R (1 − e^(−Rt/L))
///   +--------------------------+      +-------------------+     R = R1 + n² R2, L = L1 + n² L2
/// ```
#[test]
fn a_transformer_transforms_impedances_with_the_square_of_its_ratio() {
    for (ratio, n) in [("10/3", 10.0 / 3.0), ("-0.5", -0.5), ("1", 1.0)] {
        let text = source("V", "ground", "in")
            + &resistor("R1", "in", "a", "20 Ohm")
            + &inductor("L1", "a", "p", "2 mH")
            + &transformer("T", ["p", "ground", "s", "ground"], ratio)
            + &resistor("R2", "s", "b", "3 Ohm")
            + &inductor("L2", "b", "ground", "0.5 mH")
            + &scenario("0.5 ms", "1 us", "")
            + &event("0 s", "V.v", "1 V");
        let run = run(&text);
        let (r, l) = (20.0 + n * n * 3.0, 2e-3 + n * n * 0.5e-3);
        let current = |t: f64| 1.0 / r * (1.0 - (-r / l * t).exp());
        let change = |t: f64| 1.0 / l * (-r / l * t).exp();
        let second = |t: f64| n * (3.0 * current(t) + 0.5e-3 * change(t));
        follows(&run, "T.1.i", current);
        follows(&run, "T.2.i", |t| -n * current(t));
        follows(&run, "R2.i", |t| n * current(t));
        follows(&run, "T.2.v", second);
        follows(&run, "T.1.v", |t| n * second(t));
        follows(&run, "p.v", |t| n * second(t));
        // An ideal transformer keeps nothing.
        for row in 0..run.series.time.len() {
            let power =
                |winding: &str| signal(&run, &format!("{winding}.v"))[row] * signal(&run, &format!("{winding}.i"))[row];
            let (first, other) = (power("T.1"), power("T.2"));
            assert!((first + other).abs() <= 1e-12 * first.abs(), "{first} and {other} W");
        }
    }
}

/// A bridge whose arms are not in balance: currents and potentials at rest are those of the resistors alone, and at every
/// instant the currents of each node sum to zero and so do the powers of all branches (Tellegen).
#[test]
fn bridge_keeps_the_laws_of_kirchhoff() {
    let branches = ["V", "Ls", "R1", "R2", "R3", "R4", "Lb", "L4", "L3"];
    let text = source("V", "ground", "in")
        + &inductor("Ls", "in", "top", "1 mH")
        + &resistor("R1", "top", "x1", "100 Ohm")
        + &inductor("L3", "x1", "left", "1 mH")
        + &resistor("R2", "left", "ground", "200 Ohm")
        + &resistor("R3", "top", "x2", "150 Ohm")
        + &inductor("L4", "x2", "right", "2 mH")
        + &resistor("R4", "right", "ground", "50 Ohm")
        + &inductor("Lb", "left", "right", "3 mH")
        + &scenario("2 ms", "2 us", "")
        + &event("10 us", "V.v", "10 V");
    let run = run(&text);
    // At rest left and right have one potential: (100 | 150) above (200 | 50), 60 Ohm above 40 Ohm.
    for (name, expected) in [("left.v", 4.0), ("right.v", 4.0), ("V.i", 0.1), ("R1.i", 0.06), ("Lb.i", 0.04)] {
        close(at(&run, name, 2e-3), expected, 1e-8, name);
    }
    let mut moved = 0;
    for row in 0..run.series.time.len() {
        let value = |name: String| signal(&run, &name)[row];
        let power = |name: &str| value(format!("{name}.v")) * value(format!("{name}.i"));
        let powers: Vec<f64> =
            branches.iter().map(|name| if *name == "V" { -power(name) } else { power(name) }).collect();
        let shares: f64 = powers.iter().map(|p| p.abs()).sum();
        assert!(powers.iter().sum::<f64>().abs() <= 1e-12 * shares + 1e-18);
        moved += usize::from(shares > 1e-6);
        let current = |name: &str| value(format!("{name}.i"));
        let out_of_top = current("R1") + current("R3") - current("Ls");
        let out_of_left = current("R2") + current("Lb") - current("L3");
        assert!(out_of_top.abs() < 1e-15 && out_of_left.abs() < 1e-15);
    }
    assert!(moved > 500);
}

/// A capacitor with a voltage at the start rings with a coil, `v = v0 cos ωt`; both ways to say so agree: by
/// `initial_voltage`, and by a charge of a capacitor that is chosen as coordinate.
#[test]
fn a_charged_capacitor_rings() {
    let loop_of = |voltage: &str| {
        inductor("L", "a", "ground", "1 mH")
            + &element("capacitor", "C", "a", "ground", &format!("capacitance = \"1 uF\"\n{voltage}"))
    };
    let time = |extra: &str| scenario("1 ms", "2 us", extra);
    let omega = (1.0f64 / 1e-9).sqrt();
    let by_voltage = run(&(loop_of("initial_voltage = \"5 V\"") + &time("")));
    let by_charge = run(&("[model]\ncoordinates = [\"C\"]\n".to_string()
        + &loop_of("")
        + &time("initial = { \"C.q\" = \"5 uC\" }")));
    for run in [by_voltage, by_charge] {
        follows(&run, "C.v", |t| 5.0 * (omega * t).cos());
        follows(&run, "L.i", |t| 5.0 / (1e-3 * omega) * (omega * t).sin());
        assert!(run.energy.stored.abs() < 1e-8 * 12.5e-6);
    }
}

/// Table 4.3 of the source: a circuit and a drivetrain with the same numbers move alike, whatever their units.
///
/// ```text
///   τ → [ J1 ]==/\/\ s, d ==[ J2 ]| d2         u → L1 R1 to a node with C, R in series to ground, L2 R2 behind it
/// ```
#[test]
fn the_analogy_of_table_4_3() {
    let drive = "[shaft.a]\ninertia = \"0.5 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n[shaft.b]\ninertia = \"2 kg m^2\"\n\
                 damping = \"0.3 N m s/rad\"\n[spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
                 stiffness = \"8 N m/rad\"\ndamping = \"0.2 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n"
        .to_string()
        + &scenario("10 s", "10 ms", "")
        + &event("1 s", "m.tau", "3 N m");
    let circuit = source("m", "ground", "in")
        + &resistor("Ra", "in", "x", "0.1 Ohm")
        + &inductor("a", "x", "n", "0.5 H")
        + &capacitor("k", "n", "y", "0.125 F")
        + &resistor("Rk", "y", "ground", "0.2 Ohm")
        + &inductor("b", "n", "z", "2 H")
        + &resistor("Rb", "z", "ground", "0.3 Ohm")
        + &scenario("10 s", "10 ms", "")
        + &event("1 s", "m.v", "3 V");
    let (first, second) = (study::prepare(&drive).0.variants.remove(0), study::prepare(&circuit).0.variants.remove(0));
    let linear = |v: &study::PreparedVariant| kardan::reduce::linearise(&v.reduced, &[0.0; 2]);
    let (x, y) = (linear(&first), linear(&second));
    assert_eq!((&x.inertia, &x.damping, &x.stiffness, &x.input), (&y.inertia, &y.damping, &y.stiffness, &y.input));
    let (drive, circuit) = (run(&drive), run(&circuit));
    for (angle, charge) in [("a.phi", "a.q"), ("b.phi", "b.q"), ("a.w", "a.i"), ("b.w", "b.i"), ("k.tau", "n.v")] {
        for (row, (x, y)) in signal(&drive, angle).iter().zip(signal(&circuit, charge)).enumerate() {
            assert!((x - y).abs() < ACCURATE, "{angle} and {charge} in row {row}: {x} and {y}");
        }
    }
}

/// A drivetrain and a circuit in one file move as each does alone, to the tolerance of the integrator.
#[test]
fn a_drivetrain_and_a_circuit_in_one_file() {
    let ladder = model::builtin("rlc-ladder").expect("built in").source;
    let circuit = &ladder[ladder.find("[parameters]").unwrap()..ladder.find("[scenario]").unwrap()];
    let drive = "[shaft.a]\ninertia = \"1e-6 kg m^2\"\nfriction = \"0.01 N m\"\n[motor.m]\nshaft = \"a\"\n";
    let time = scenario("1 ms", "2 us", "");
    let (volts, torque) = (event("0.1 ms", "supply.v", "1 V"), event("0.2 ms", "m.tau", "0.1 N m"));
    let both = run(&(circuit.to_string() + drive + &time + &volts + &torque));
    let circuit = run(&(circuit.to_string() + &time + &volts));
    let drive = run(&(drive.to_string() + &time + &torque));
    for (separate, name) in [(&circuit, "C4.v"), (&circuit, "supply.i"), (&drive, "a.phi"), (&drive, "a.friction")] {
        let mut compared = 0;
        for (time, value) in both.series.time.iter().zip(signal(&both, name)) {
            let Some(row) = separate.series.time.iter().position(|t| t == time) else { continue };
            let other = signal(separate, name)[row];
            assert!((value - other).abs() <= ACCURATE * 1.3, "{name} at {time} s: {value} and {other}");
            compared += 1;
        }
        assert!(compared > 400, "{name}: {compared} rows");
    }
}

// ---- ngspice ------------------------------------------------------------------------------------------------------

/// Compares columns of a golden file with signals from a time on; tolerances in V and A.
fn compare(csv: &str, run: &Run, start: f64, signals: &[(&str, &str)]) {
    let mut lines = csv.lines();
    let columns: Vec<&str> = lines.next().expect("a header").split(',').collect();
    assert_eq!(columns.len(), signals.len() + 1, "all columns are compared");
    let (mut compared, mut worst) = (0, vec![0.0f64; signals.len()]);
    for line in lines {
        let row: Vec<f64> = line.split(',').map(|field| field.parse().expect("a number")).collect();
        let time = start + row[0];
        let at = run.series.time.iter().position(|t| (t - time).abs() < 1e-12).expect("a row at this time");
        compared += 1;
        for (k, (column, name)) in signals.iter().enumerate() {
            let expected = row[columns.iter().position(|c| c == column).expect("golden column")];
            // Error of ngspice (see above) and of ten digits.
            let tolerance = if column.starts_with('v') { 2e-9 } else { 5e-11 };
            let error = (signal(run, name)[at] - expected).abs();
            assert!(error <= tolerance, "{name} at {time} s: off by {error:e} from {expected}");
            worst[k] = worst[k].max(error);
        }
    }
    assert!(compared > 180, "{compared} rows");
    for ((_, name), error) in signals.iter().zip(worst) {
        println!("{name} differs by at most {error:.2e}");
        assert!(error > 0.0, "ngspice makes errors of its own");
    }
}

#[test]
fn the_ladder_of_ngspice() {
    let run = run(model::builtin("rlc-ladder").expect("built in").source);
    let signals = [
        ("v_n1", "C1.v"),
        ("v_n2", "n2.v"),
        ("v_n3", "C3.v"),
        ("v_n4", "C4.v"),
        ("i_l1", "supply.i"),
        ("i_ll", "R_load.i"),
    ];
    compare(include_str!("../golden/rlc_ladder.csv"), &run, 1e-4, &signals);
}

#[test]
fn the_transformer_of_ngspice() {
    let text = source("V1", "ground", "in")
        + &resistor("R1", "in", "a", "20 Ohm")
        + &inductor("L1", "a", "p", "2 mH")
        + &inductor("Lm", "p", "ground", "50 mH")
        + &transformer("T", ["p", "ground", "s", "ground"], "10/3")
        + &inductor("L2", "s", "o", "0.1 mH")
        + &resistor("R2", "o", "ground", "3 Ohm")
        + &inductor("L3", "s", "c", "0.1 mH")
        + &capacitor("C1", "c", "ground", "4.7 uF")
        + &scenario("2 ms", "10 us", "")
        + &event("0 s", "V1.v", "1 V");
    let signals = [("v_c", "C1.v"), ("i_l1", "V1.i"), ("i_lm", "Lm.i"), ("i_l2", "R2.i"), ("i_l3", "L3.i")];
    compare(include_str!("../golden/rlc_transformer.csv"), &run(&text), 0.0, &signals);
}

/// Half the tolerance, a smaller error: against a run at 1e-13, those at 1e-6, 1e-8 and 1e-10 come closer each time.
#[test]
fn the_ladder_converges() {
    let ladder = model::builtin("rlc-ladder").expect("built in").source;
    let with = |tolerance: &str| {
        run(&ladder.replace("[scenario]\n", &format!("[scenario]\nrelative_tolerance = {tolerance}\n")))
    };
    let best = with("1e-13");
    let error = |tolerance: &str| {
        let run = with(tolerance);
        let pairs = signal(&run, "C4.v").iter().zip(signal(&best, "C4.v"));
        pairs.fold(0.0f64, |max, (x, y)| max.max((x - y).abs()))
    };
    let errors = ["1e-6", "1e-8", "1e-10"].map(error);
    assert!(errors[1] < 0.1 * errors[0] && errors[2] < 0.1 * errors[1] && errors[2] < 1e-9, "{errors:?}");
}
