//! Motions without inertia: springs in series, Maxwell elements, RC circuits, against closed forms and matrix exponentials.

use crate::common::{close, prepared, run_by, signal};
use kardan::diagnostics::Severity;
use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study::{self, AnalyzeSettings, EquationsForm, Project, Settings, Silent};

const METHODS: [Method; 4] = [Method::Automatic, Method::Taylor, Method::Dop853, Method::Radau];

fn shaft(name: &str, inertia: f64) -> String {
    if inertia == 0.0 {
        format!("[shaft.{name}]\n")
    } else {
        format!("[shaft.{name}]\ninertia = \"{inertia} kg m^2\"\n")
    }
}

fn spring(name: &str, from: &str, to: &str, values: &str) -> String {
    format!("[spring_damper.{name}]\nshaft_1 = \"{from}\"\nshaft_2 = \"{to}\"\n{values}\n")
}

fn scenario(duration: f64, initial: &str) -> String {
    format!(
        "[scenario]\nduration = \"{duration} s\"\noutput_step = \"{} s\"\nrelative_tolerance = 1e-10\ninitial = {{ {initial} }}\n",
        duration / 20.0
    )
}

/// The energy balance closes relative to what is stored at the start or goes in.
fn balances(run: &Run, scale: f64) {
    assert!(run.energy.residual.abs() <= 1e-8 * scale, "{:?}", run.energy);
}

/// `e^{A t} x` by halving the time until the series converges at once.
fn exponential(a: &[Vec<f64>], x: &[f64], t: f64) -> Vec<f64> {
    let n = a.len();
    let size: f64 = a.iter().flatten().map(|x| x.abs()).sum::<f64>() * t;
    let parts = (size * 4.0).ceil().max(1.0);
    let mut x = x.to_vec();
    for _ in 0..parts as usize {
        let (mut term, mut sum) = (x.clone(), x.clone());
        for k in 1..20 {
            term = (0..n).map(|i| (0..n).map(|j| a[i][j] * term[j]).sum::<f64>() * t / parts / f64::from(k)).collect();
            sum.iter_mut().zip(&term).for_each(|(sum, term)| *sum += term);
        }
        x = sum;
    }
    x
}

/// ```text
///   [ J ]~~s1~~ m1 ==2:1== m2 ~~s2~~|     m1, m2 have no inertia: one spring s1 and s2/4 in series
/// ```
#[test]
fn springs_in_series_swing_as_one() {
    let (j, s1, s2) = (0.5, 300.0, 800.0);
    let model = shaft("a", j)
        + &shaft("m1", 0.0)
        + &shaft("m2", 0.0)
        + "[gear.g]\nshaft_1 = \"m1\"\nshaft_2 = \"m2\"\nratio = 2\n"
        + &spring("s1", "a", "m1", &format!("stiffness = \"{s1} N m/rad\""))
        + &spring("s2", "m2", "ground", &format!("stiffness = \"{s2} N m/rad\""));
    let stiffness = 1.0 / (1.0 / s1 + 4.0 / s2);
    let omega = (stiffness / j).sqrt();
    let source = model.clone() + &scenario(2.0, "\"a.phi\" = \"0.1 rad\"");
    for method in METHODS {
        let run = run_by(&source, method, None);
        for (k, t) in run.series.time.iter().enumerate() {
            let phi = 0.1 * (omega * t).cos();
            close(signal(&run, "a.phi")[k], phi, 1e-7, "a.phi");
            close(signal(&run, "s1.tau")[k], stiffness * phi, 1e-5, "the same torque in both springs");
            close(signal(&run, "s2.tau")[k], 2.0 * stiffness * phi, 1e-5, "behind the gear");
            close(signal(&run, "m2.phi")[k], 2.0 * stiffness * phi / s2, 1e-8, "m2.phi");
            close(signal(&run, "m2.w")[k], -2.0 * stiffness * 0.1 * omega * (omega * t).sin() / s2, 1e-6, "m2.w");
        }
        balances(&run, 0.5 * stiffness * 0.01);
        // Nothing pushes along an equation of equilibrium.
        assert!(run.series.signals.iter().all(|signal| !signal.name.contains("equilibrium")));
    }
    let (text, _) = Project::open(&source).equations(EquationsForm::Text).expect("equations");
    assert!(text.contains("equilibrium of m2: "), "{text}");
    assert_eq!(prepared(&source).variants[0].reduced.degrees_of_freedom(), 1);
}

/// A rest angle moves the equilibrium: `m = (s1 a + s2 (−rest))/(s1 + s2)`.
#[test]
fn rest_angles_stand_in_the_equilibrium() {
    let model = shaft("a", 1.0)
        + &shaft("m", 0.0)
        + &spring("s1", "a", "m", "stiffness = \"3 N m/rad\"\nrest = \"0.5 rad\"\ndamping = \"0 N m s/rad\"")
        + &spring("s2", "m", "ground", "stiffness = \"1 N m/rad\"\nrest = \"0.25 rad\"")
        + &scenario(1.0, "\"a.phi\" = \"0.75 rad\"");
    let run = run_by(&model, Method::Automatic, None);
    // Both springs are relaxed at a = 0.75, m = 0.25: at rest.
    for (name, value) in [("a.phi", 0.75), ("m.phi", 0.25), ("s1.tau", 0.0), ("s2.tau", 0.0)] {
        signal(&run, name).iter().for_each(|x| close(*x, value, 1e-15, name));
    }
}

/// ```text
///   |~~s~~ m --d--|      m(t) = m₀ exp(−t s/d): nothing has an inertia
/// ```
#[test]
fn maxwell_element_relaxes() {
    let model = shaft("m", 0.0)
        + &spring("s", "m", "ground", "stiffness = \"6 N m/rad\"")
        + &spring("d", "m", "ground", "damping = \"2 N m s/rad\"")
        + &scenario(2.0, "\"m.phi\" = \"0.4 rad\"");
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (k, t) in run.series.time.iter().enumerate() {
            let m = 0.4 * (-3.0 * t).exp();
            close(signal(&run, "m.phi")[k], m, 1e-9, "m.phi");
            close(signal(&run, "m.w")[k], -3.0 * m, 3e-9, "m.w");
            close(signal(&run, "s.tau")[k] + signal(&run, "d.tau")[k], 0.0, 1e-12, "nothing is left over");
        }
        close(run.energy.dissipated, 0.5 * 6.0 * 0.16 * (1.0 - (-12.0f64).exp()), 1e-8, "all of the spring's energy");
        balances(&run, 0.48);
    }
}

/// ```text
///   τ → [ J ]~~s1~~ n ~~s2~~ m --d--|     two springs in series with a damper; m is pushed too, and a damper ties it to J
///         '----------d2------'
/// ```
#[test]
fn zener_element_follows_its_exponential() {
    let (j, s1, s2, d, d2, tau, push) = (0.7, 40.0, 60.0, 3.0, 1.5, 2.0, -0.8);
    let model = shaft("a", j)
        + &shaft("m", 0.0)
        + &shaft("n", 0.0)
        + &spring("s1", "a", "n", &format!("stiffness = \"{s1} N m/rad\""))
        + &spring("s2", "n", "m", &format!("stiffness = \"{s2} N m/rad\""))
        + &spring("d", "m", "ground", &format!("damping = \"{d} N m s/rad\""))
        + &spring("d2", "a", "m", &format!("damping = \"{d2} N m s/rad\""))
        + "[motor.ma]\nshaft = \"a\"\n[motor.mm]\nshaft = \"m\"\n"
        + &scenario(1.5, "\"a.phi\" = \"0.2 rad\", \"a.w\" = \"-1 rad/s\", \"m.phi\" = \"0.05 rad\"")
        + &format!("[[scenario.event]]\nat = \"0 s\"\nsignal = \"ma.tau\"\nto = \"{tau} N m\"\n")
        + &format!("[[scenario.event]]\nat = \"0 s\"\nsignal = \"mm.tau\"\nto = \"{push} N m\"\n");
    // J a¨ = τ − s (a − m) − d2 (a˙ − m˙), (d + d2) m˙ = push + s (a − m) + d2 a˙
    let s = 1.0 / (1.0 / s1 + 1.0 / s2);
    let (all, share) = (d + d2, d2 / (d + d2));
    let a = vec![
        vec![0.0, 1.0, 0.0, 0.0],
        vec![(-s + share * s) / j, (-d2 + share * d2) / j, (s - share * s) / j, (tau + share * push) / j],
        vec![s / all, share, -s / all, push / all],
        vec![0.0; 4],
    ];
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (k, t) in run.series.time.iter().enumerate() {
            let x = exponential(&a, &[0.2, -1.0, 0.05, 1.0], *t);
            let speed: f64 = a[2].iter().zip(&x).map(|(a, x)| a * x).sum();
            let n = x[0] - s / s1 * (x[0] - x[2]);
            for (name, value) in [("a.phi", x[0]), ("a.w", x[1]), ("m.phi", x[2]), ("m.w", speed), ("n.phi", n)] {
                close(signal(&run, name)[k], value, 1e-7, &format!("{name} at {t}"));
            }
            close(signal(&run, "d.tau")[k], d * speed, 1e-6, "d.tau");
        }
        balances(&run, run.energy.dissipated);
    }
    // A run tells the structure of such a model.
    let study = Project::open(&model).run(&Settings::default(), &Silent).expect("a study");
    assert!(study.warnings.iter().all(|warning| !warning.contains("structure")), "{:?}", study.warnings);
}

/// ```text
///   V --R1--+--R2--+        two sections of an RC ladder, a step of 5 V
///           C1     C2
/// ```
#[test]
fn rc_ladder_charges_as_its_exponential() {
    let (r1, c1, r2, c2, volt) = (1000.0, 1e-6, 2200.0, 4.7e-7, 5.0);
    let branch = |kind: &str, name: &str, from: &str, to: &str, value: &str| {
        format!("[{kind}.{name}]\nfrom = \"{from}\"\nto = \"{to}\"\n{value}\n")
    };
    let model = branch("voltage_source", "V", "ground", "in", "")
        + &branch("resistor", "R1", "in", "a", "resistance = \"1 kOhm\"")
        + &branch("capacitor", "C1", "a", "ground", "capacitance = \"1 uF\"")
        + &branch("resistor", "R2", "a", "b", "resistance = \"2200 Ohm\"")
        + &branch("capacitor", "C2", "b", "ground", "capacitance = \"0.47 uF\"")
        + "[scenario]\nduration = \"10 ms\"\noutput_step = \"0.5 ms\"\nrelative_tolerance = 1e-10\n"
        + "[[scenario.event]]\nat = \"0 s\"\nsignal = \"V.v\"\nto = \"5 V\"\n";
    // C1 v1' = (V − v1)/R1 − (v1 − v2)/R2, C2 v2' = (v1 − v2)/R2
    let a = vec![
        vec![-(1.0 / r1 + 1.0 / r2) / c1, 1.0 / (r2 * c1), volt / (r1 * c1)],
        vec![1.0 / (r2 * c2), -1.0 / (r2 * c2), 0.0],
        vec![0.0; 3],
    ];
    for method in METHODS {
        let run = run_by(&model, method, None);
        for (k, t) in run.series.time.iter().enumerate() {
            let x = exponential(&a, &[0.0, 0.0, 1.0], *t);
            close(signal(&run, "C1.v")[k], x[0], 1e-7, "C1.v");
            close(signal(&run, "C2.v")[k], x[1], 1e-7, "C2.v");
            close(signal(&run, "R2.i")[k], (x[0] - x[1]) / r2, 1e-10, "R2.i");
        }
        balances(&run, run.energy.input);
    }
}

/// A chain of 12 Maxwell elements beside random inertias: the energy balance closes, and rows do not depend on the method.
#[test]
fn long_chains_balance() {
    let mut model = String::new();
    for k in 0..12 {
        model += &shaft(&format!("q{k:02}"), if k % 3 == 0 { 0.1 + 0.05 * f64::from(k) } else { 0.0 });
    }
    for k in 1..12 {
        let values = match k % 3 {
            0 => "stiffness = \"50 N m/rad\"\ndamping = \"0.4 N m s/rad\"",
            1 => "stiffness = \"80 N m/rad\"",
            _ => "damping = \"2 N m s/rad\"",
        };
        model += &spring(&format!("k{k:02}"), &format!("q{:02}", k - 1), &format!("q{k:02}"), values);
    }
    model += &scenario(3.0, "\"q00.phi\" = \"0.3 rad\", \"q06.w\" = \"2 rad/s\"");
    let stored = 0.5 * 0.4 * 4.0;
    let first = run_by(&model, Method::Taylor, None);
    balances(&first, stored);
    for method in [Method::Automatic, Method::Dop853, Method::Radau] {
        let run = run_by(&model, method, None);
        balances(&run, stored);
        for (signal, other) in run.series.signals.iter().zip(&first.series.signals) {
            signal.values.iter().zip(&other.values).for_each(|(x, y)| close(*x, *y, 1e-6, &signal.name));
        }
    }
}

/// A motor without inductance drives a load by teeth with losses: the teeth feel what its current follows at once. Of η of what it gives
/// the load has M, `(J + J_L/(η n²)) ω' = k (u − k ω)/R − M/(η n)`.
#[test]
fn a_winding_of_zero_inductance_drives_a_gear_with_losses() {
    let [k, resistance, j, load, ratio, efficiency, weight, voltage] = [0.02, 0.5, 1e-4, 0.1, 40.0, 0.6, 3.0, 12.0];
    let source = format!(
        "[voltage_source.supply]\nfrom = \"b\"\nto = \"ground\"\n[dc_motor.m]\nfrom = \"b\"\nto = \"ground\"\nshaft = \"motor\"\n\
         torque_constant = \"{k} N m/A\"\nresistance = \"{resistance} Ohm\"\n\
         [gear.worm]\nshaft_1 = \"motor\"\nshaft_2 = \"load\"\nratio = {ratio}\nefficiency = {efficiency}\nefficiency_back = 0.2\n\
         [torque.weight]\nshaft = \"load\"\nlaw = \"-{weight} N m\"\n[[scenario.event]]\nat = \"0 s\"\nsignal = \"supply.v\"\nto = \"-{voltage} V\"\n"
    ) + &shaft("motor", j)
        + &shaft("load", load)
        + &scenario(1.0, "");
    let torque = k * voltage / resistance - weight / (efficiency * ratio);
    let constant = (j + load / (efficiency * ratio * ratio)) * resistance / (k * k);
    let last = torque * resistance / (k * k);
    // What the teeth carry follows from the shaft that is no coordinate: the motor's, with its current, or the load's.
    for (method, coordinate) in METHODS.into_iter().flat_map(|method| [(method, "load"), (method, "motor")]) {
        let chosen = format!("[model]\ncoordinates = [\"m\", \"{coordinate}\"]\n{source}");
        let run = run_by(&chosen, method, None);
        let speed = signal(&run, "motor.w");
        for (time, speed) in run.series.time.iter().zip(speed) {
            let expected = last * (1.0 - (-time / constant).exp());
            assert!(
                (speed.abs() - expected).abs() <= 1e-7 * last,
                "{method:?} {coordinate} {time}: {speed} {expected}"
            );
        }
        balances(&run, run.energy.input);
    }
}

/// What none of these holds is refused by name, with the reason.
#[test]
fn undetermined_motions_are_refused_by_name() {
    let refused = |model: &str, fragments: &[&str]| {
        let found = study::check(&(shaft("a", 1.0) + &shaft("m", 0.0) + model));
        let errors: Vec<_> = found.iter().filter(|one| one.severity == Severity::Error).collect();
        assert_eq!(errors.len(), 1, "{found:#?}");
        for fragment in fragments {
            assert!(errors[0].message.contains(fragment), "{fragment}: {}", errors[0].message);
        }
        assert!(errors[0].help.is_some() && !errors[0].labels.is_empty());
    };
    let soft = "stiffness = \"1 N m/rad\"";
    refused("", &["`m`", "nothing acts on `m`"]);
    refused("[motor.push]\nshaft = \"m\"\n", &["`m`", "nothing resists `push`", "infinitely fast"]);
    refused(
        &(spring("s", "a", "m", soft) + "[motor.push]\nshaft = \"m\"\n"),
        &["`m`", "only springs resist `push`", "jump"],
    );
    refused(
        &(spring("s", "a", "m", soft)
            + "[spring_damper.f]\nshaft_1 = \"m\"\nfriction = \"1 N m\"\ndamping = \"1 N m s/rad\"\n"),
        &["`m`", "the friction of `f` and the damping of `f` both act on it"],
    );
    refused(
        &(spring("s", "a", "m", "damping = \"1 N m s/rad\"") + &scenario(1.0, "\"m.w\" = \"1 rad/s\"")),
        &["`m`", "no inertia", "cannot be given"],
    );
    refused(
        &("[model]\ncoordinates = [\"a\", \"m\"]\n".to_string() + &spring("s", "a", "m", soft)),
        &["`m`", "1 degree of freedom", "2 coordinates"],
    );
}

/// Runs with everything beside them, analyses and equations take such models.
#[test]
fn commands_accept_massless_motions() {
    let start = shaft("a", 1.0) + &shaft("m", 0.0) + &scenario(1.0, "\"a.w\" = \"1 rad/s\"");
    let jenkins = "[spring_damper.f]\nshaft_1 = \"m\"\nfriction = \"0.1 N m\"\n";
    let soft = spring("s", "a", "m", "stiffness = \"5 N m/rad\"");
    let ends = [
        spring("t", "m", "ground", "stiffness = \"5 N m/rad\""),
        spring("t", "m", "ground", "damping = \"5 N m s/rad\""),
        jenkins.to_string(),
    ];
    for end in ends {
        let source = start.clone() + &soft + &end;
        let study = Project::open(&source).run(&Settings::default(), &Silent).expect("a study");
        assert!(study.warnings.is_empty(), "{:?}", study.warnings);
        assert!(study.analysis.is_some(), "{source}");
        let settings = AnalyzeSettings::default();
        Project::open(&source).analyze(&settings, &Silent).expect("an analysis");
        for form in [EquationsForm::Text, EquationsForm::Latex, EquationsForm::Plan] {
            Project::open(&source).equations(form).expect("equations");
        }
    }
}
