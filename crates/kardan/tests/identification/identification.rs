//! From logs to parameters: logs made here from the equations of the source, with noise of known size.

use std::fmt::Write;

use kardan::diagnostics::plain;
use kardan::model::{builtin, read};
use kardan::num::Random;
use kardan::results::{Identification, IdentifiedParameter, Verdict};
use kardan::study::{self, IdentifySettings, LogFile, Silent, identify};
use kardan::tables::read::in_memory;

/// Table 6.1: inertias, dampings by (6.34), Coulomb frictions of wg, cs, fs.
const INERTIA: [f64; 3] = [130e-6, 10250.34e-6, 10297.41e-6];
const DAMPING: [f64; 3] = [251.0 / 510_000.0, -0.0123, 1.0 / 51.0];
const FRICTION: [f64; 3] = [0.0361, 0.1847, 0.0091];
/// K of (6.9): speeds of wg, cs, fs over those of wg, cs; i = 50.
const BASIS: [[f64; 2]; 3] = [[1.0, 0.0], [0.0, 1.0], [-1.0 / 50.0, 51.0 / 50.0]];
/// Standard deviations of the torque sensors of wg and cs, N m.
const NOISE: [f64; 2] = [0.005, 0.02];
const STEP: f64 = 1e-3;

fn normal(random: &mut Random) -> f64 {
    let (a, b) = (1.0 - random.unit(), random.unit());
    (-2.0 * a.ln()).sqrt() * (std::f64::consts::TAU * b).cos()
}

/// A row of a log: time, angles, speeds, accelerations of wg and cs.
type Row = (f64, [f64; 2], [f64; 2], [f64; 2]);

/// Speeds over a grid: half a second to get there, then constant.
fn grid(dwell: f64) -> Vec<Row> {
    let mut points = Vec::new();
    for wg in [-100.0, -40.0, 40.0, 100.0] {
        for cs in [-4.0, -1.5, 1.5, 4.0] {
            points.push([wg, cs]);
        }
    }
    let mut rows = Vec::new();
    let (mut time, mut angle, mut from) = (0.0, [0.0; 2], [0.0; 2]);
    for to in points {
        let (ramp, hold) = (500, (dwell / STEP) as usize);
        for k in 0..ramp + hold {
            let x = (k as f64 / ramp as f64).min(1.0);
            let smooth = x * x * (3.0 - 2.0 * x);
            let slope = 6.0 * x * (1.0 - x) / (ramp as f64 * STEP);
            let speed = [0, 1].map(|j| from[j] + (to[j] - from[j]) * smooth);
            rows.push((time, angle, speed, [0, 1].map(|j| (to[j] - from[j]) * slope)));
            time += STEP;
            // The next angle, exactly for constant speeds and to third order on ramps.
            let next = ((k + 1) as f64 / ramp as f64).min(1.0);
            let area = |x: f64| x * x * x - 0.5 * x.powi(4);
            for j in 0..2 {
                let moved = (area(next) - area(x)) * ramp as f64 * STEP;
                let advance = if next > x { from[j] * STEP } else { to[j] * STEP };
                angle[j] += advance + (to[j] - from[j]) * moved;
            }
        }
        from = to;
    }
    rows
}

/// Torques of the motors of wg and cs by the corrected (6.33)-(6.40), with inertias.
fn torques(speed: [f64; 2], acceleration: [f64; 2], more: impl Fn(usize, f64) -> f64) -> [f64; 2] {
    let mut out = [0.0; 2];
    for (k, row) in BASIS.iter().enumerate() {
        let direction = |x: [f64; 2]| row[0] * x[0] + row[1] * x[1];
        let (w, a) = (direction(speed), direction(acceleration));
        let torque = INERTIA[k] * a + DAMPING[k] * w + (FRICTION[k] + more(k, w)) * w.signum();
        (0..2).for_each(|j| out[j] += row[j] * torque);
    }
    out
}

/// A log as text: encoders of 3520 and 8192 lines, noisy torques.
fn csv(rows: &[Row], seed: u64, more: impl Fn(usize, f64) -> f64 + Copy) -> String {
    let mut random = Random::new(seed);
    let mut out = String::from("time,wg.phi,cs.phi,wg_motor.tau,cs_motor.tau\ns,rad,rad,N m,N m\n");
    let round = |x: f64, lines: f64| {
        let step = std::f64::consts::TAU / 4.0 / lines;
        (x / step).floor() * step
    };
    for (time, angle, speed, acceleration) in rows {
        let tau = torques(*speed, *acceleration, more);
        let noisy = [0, 1].map(|j| tau[j] + NOISE[j] * normal(&mut random));
        let _ = writeln!(
            out,
            "{time:.6},{:.7},{:.7},{:.7},{:.7}",
            round(angle[0], 3520.0),
            round(angle[1], 8192.0),
            noisy[0],
            noisy[1]
        );
    }
    out
}

fn drive() -> &'static str {
    builtin("harmonic-drive").expect("built in").source
}

fn settings(parameters: &[&str], method: &str) -> IdentifySettings {
    IdentifySettings {
        variant: Some("position-friction".into()),
        parameters: parameters.iter().map(|name| name.to_string()).collect(),
        method: (!method.is_empty()).then(|| method.to_string()),
        ..IdentifySettings::default()
    }
}

fn file(name: &str, text: String) -> LogFile {
    LogFile { name: name.into(), bytes: in_memory(text.into_bytes()) }
}

fn found(source: &str, logs: Vec<String>, settings: &IdentifySettings) -> Identification {
    let files = logs.into_iter().enumerate().map(|(k, text)| file(&format!("log-{k}.csv"), text)).collect();
    identify(source, files, settings, &Silent).unwrap_or_else(|wrong| panic!("{}", plain(source, &wrong)))
}

fn refused(source: &str, logs: Vec<(&str, String)>, settings: &IdentifySettings) -> String {
    let files = logs.into_iter().map(|(name, text)| file(name, text)).collect();
    match identify(source, files, settings, &Silent) {
        Ok(_) => panic!("that should not work"),
        Err(wrong) => {
            assert!(
                wrong.iter().all(|one| !one.message.is_empty() && one.help.is_some() || one.code.starts_with("log"))
            );
            plain(source, &wrong)
        }
    }
}

fn one<'a>(found: &'a Identification, name: &str) -> &'a IdentifiedParameter {
    found.parameters.iter().find(|one| one.name == name).unwrap_or_else(|| panic!("no {name}"))
}

/// Within so many standard errors of the truth.
fn near(found: &Identification, name: &str, truth: f64, errors: f64) {
    let one = one(found, name);
    let off = (one.value.unwrap() - truth) / one.standard_error.unwrap();
    assert!(off.abs() < errors, "{name}: {} instead of {truth}, {off:.1} standard errors", one.value.unwrap());
}

const SIX: [&str; 6] = ["wg.damping", "cs.damping", "fs.damping", "wg.friction", "cs.friction", "fs.friction"];

fn truth(name: &str) -> f64 {
    let (shaft, key) = name.split_once('.').expect("a key");
    let k = ["wg", "cs", "fs"].iter().position(|other| *other == shaft).expect("a shaft");
    match key {
        "damping" => DAMPING[k],
        "friction" => FRICTION[k],
        _ => INERTIA[k],
    }
}

/// Propositions 6.1 and 6.2 on a log with encoders and noise; the relations (6.34); the remark on an equivalent damping below
/// zero in a drive that is passive as a whole.
#[test]
fn table_6_1_from_a_log() {
    let found = found(drive(), vec![csv(&grid(1.0), 3, |_, _| 0.0)], &settings(&SIX, "steady"));
    assert_eq!((found.method.as_str(), found.coordinates.as_slice()), ("steady", &["wg".to_string(), "cs".into()][..]));
    assert_eq!(found.samples, 16);
    for name in SIX {
        near(&found, name, truth(name), 4.0);
        let one = one(&found, name);
        assert!(one.standard_error.unwrap() < 0.1 * truth(name).abs(), "{name} {}", one.standard_error.unwrap());
        let half = (one.interval.unwrap().upper - one.interval.unwrap().lower) / 2.0;
        assert!(
            (one.value.unwrap() - (one.interval.unwrap().lower + one.interval.unwrap().upper) / 2.0).abs() < 1e-9
                && half > 1.9 * one.standard_error.unwrap()
        );
    }
    assert!(
        one(&found, "cs.damping").interval.unwrap().upper < 0.0 && found.warnings.is_empty(),
        "{:?}",
        found.warnings
    );
    let damping = found.damping.as_ref().expect("dampings were asked for");
    assert!(damping.passive);
    let [wg, cs, fs] = ["wg.damping", "cs.damping", "fs.damping"].map(|name| one(&found, name).value.unwrap());
    let expected =
        [[wg + fs / 2500.0, -51.0 / 2500.0 * fs], [-51.0 / 2500.0 * fs, cs + (51.0_f64 / 50.0).powi(2) * fs]];
    for i in 0..2 {
        for j in 0..2 {
            assert!((damping.values[i][j] - expected[i][j]).abs() < 1e-12, "(6.34), {i} {j}");
        }
    }
    // Noise of the channels as it is: that of an encoder is its step over the root of twelve, or less at constant speed.
    let noise: Vec<f64> = found.logs[0].channels.iter().map(|one| one.noise).collect();
    assert!((noise[2] / NOISE[0] - 1.0).abs() < 0.05 && (noise[3] / NOISE[1] - 1.0).abs() < 0.05, "{noise:?}");
    assert!((noise[0] / (std::f64::consts::TAU / 14080.0 / 12f64.sqrt()) - 1.0).abs() < 0.1, "{noise:?}");
    assert!(
        found.validation.iter().all(|row| row.cross_validated.unwrap() < 0.02 * row.torque),
        "{:?}",
        found.validation
    );
}

/// Everything at once, inertias too, by filtered derivatives; and what is left over is what the sensors' noise makes. Encoders round
/// the same motion the same way in every log, which is worth another standard error.
#[test]
fn inertias_by_filtered_derivatives() {
    let all = [&SIX[..], &["wg.inertia", "cs.inertia", "fs.inertia"]].concat();
    let found = found(drive(), vec![csv(&grid(0.2), 5, |_, _| 0.0)], &settings(&all, "dynamic"));
    for name in all {
        near(&found, name, truth(name), 5.0);
    }
    assert!((found.scale - 1.0).abs() < 0.1, "{}", found.scale);
    assert!(found.tests.iter().all(|test| test.probability > 1e-4), "{:?}", found.tests);
    assert!(found.windows.sticking > 0 && found.windows.used > 100);
}

/// Intervals of 95 % cover the truth about as often: 60 logs, six parameters. The count of a binomial distribution with 360 trials
/// has the standard deviation 4.1; those of one log are not quite independent.
#[test]
fn intervals_cover() {
    let rows = grid(0.6);
    let mut covered = 0;
    for seed in 0..60 {
        let found = found(drive(), vec![csv(&rows, 1000 + seed, |_, _| 0.0)], &settings(&SIX, "steady"));
        for name in SIX {
            let interval = one(&found, name).interval;
            covered += u32::from(interval.unwrap().lower <= truth(name) && truth(name) <= interval.unwrap().upper);
        }
    }
    assert!((325..=356).contains(&covered), "{covered} of 360");
}

/// Where nobody measured a torque it is eliminated, and what then cannot be told is said.
#[test]
fn an_unmeasured_torque_is_eliminated() {
    let log = csv(&grid(0.6), 7, |_, _| 0.0);
    let blind: String = log.lines().map(|line| line.rsplit_once(',').expect("columns").0.to_string() + "\n").collect();
    // What acts along it alone is lost by structure; the flexspline's damping and friction are seen through the other torque.
    let six = self::found(drive(), vec![blind.clone()], &settings(&SIX, "steady"));
    assert_eq!(six.unidentifiable.structurally.len(), 2, "{:?}", six.unidentifiable.structurally);
    for name in ["cs.damping", "cs.friction"] {
        assert!(
            one(&six, name).standard_error.unwrap().is_infinite()
                && one(&six, name).remark.contains("whichever signals are logged")
        );
    }
    for (name, truth) in [("wg.damping", DAMPING[0]), ("wg.friction", FRICTION[0]), ("fs.damping", DAMPING[2])] {
        near(&six, name, truth, 4.0);
    }
    assert!(six.for_file.values.iter().all(|value| !value.name.starts_with("cs.")));
    let found = found(drive(), vec![blind], &settings(&["wg.damping", "wg.friction"], "steady"));
    assert_eq!(
        (found.eliminated.as_slice(), found.measured.as_slice()),
        (&["cs_motor".to_string()][..], &["wg_motor".into()][..])
    );
    // The other frictions are known to the model.
    near(&found, "wg.damping", DAMPING[0], 4.0);
    near(&found, "wg.friction", FRICTION[0], 4.0);
}

const GEARS: &str = "[model]\nname = \"gears\"\n[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
                     damping = \"1 N m s/rad\"\n[gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\n[motor.m]\nshaft = \"a\"\n";

/// a turns three times as fast as b: of their inertias J_a + J_b/9 alone can be told, whatever is logged; at constant speed nothing.
#[test]
fn combinations_by_structure() {
    let mut log = String::from("time,a.w,m.tau\n");
    let mut random = Random::new(1);
    for k in 0..4000 {
        let t = 0.001 * f64::from(k);
        let (w, a) = (5.0 + (3.0 * t).sin(), 3.0 * (3.0 * t).cos());
        let tau = (2.0 + 4.5 / 9.0) * a + 0.9 / 9.0 * w + 0.05 * normal(&mut random);
        let _ = writeln!(log, "{t},{w},{tau}");
    }
    let options = |method: &str| IdentifySettings {
        parameters: ["a.inertia", "b.inertia", "b.damping"].map(String::from).to_vec(),
        method: Some(method.into()),
        ..IdentifySettings::default()
    };
    let whole = found(GEARS, vec![log.clone()], &options("dynamic"));
    let a = one(&whole, "a.inertia");
    assert_eq!(a.combination, " + 0.111111 b.inertia");
    near(&whole, "a.inertia", 2.5, 4.0);
    near(&whole, "b.damping", 0.9, 4.0);
    assert!(one(&whole, "b.inertia").standard_error.unwrap().is_infinite());
    assert_eq!(
        whole.unidentifiable.structurally,
        ["b.inertia up by 1 and a.inertia down by 0.111111 give the same torques"]
    );
    // Constant speeds only: nothing accelerates.
    let constant_speeds: String = "time,a.w,m.tau\n".to_string()
        + &(0..4000)
            .map(|k| {
                let w = f64::from(1 + k / 500);
                format!("{},{w},{}\n", 0.001 * f64::from(k), 0.1 * w + 0.01 * normal(&mut random))
            })
            .collect::<String>();
    let steady = found(GEARS, vec![constant_speeds], &options("steady"));
    assert_eq!(steady.unidentifiable.structurally.len(), 2);
    assert!(one(&steady, "a.inertia").remark.contains("whichever signals are logged"));
    near(&steady, "b.damping", 0.9, 4.0);
}

fn shaft_log(seed: u64, torque: impl Fn(f64, f64) -> f64) -> String {
    let mut random = Random::new(seed);
    let mut out = String::from("t;s.w;m.tau;load.tau\ns;rad/s;N m;N m\n");
    for k in 0..20_000 {
        let t = 0.001 * f64::from(k);
        // Slow sweeps through a wide range of speeds, both ways.
        let w = 20.0 * (0.4 * t).sin().powi(3) + 0.5 * (2.3 * t).sin();
        let a = 24.0 * (0.4 * t).sin().powi(2) * (0.4 * t).cos() + 1.15 * (2.3 * t).cos();
        let load = 3.0 + 2.0 * (0.9 * t).sin();
        let tau = 0.01 * a + torque(w, load) - load + 0.01 * normal(&mut random);
        let _ = writeln!(out, "{t:.3};{w:.9};{tau:.9};{load:.9}");
    }
    out
}

const SHAFT: &str = "[shaft.s]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.02 N m s/rad\"\nfriction = \"0.3 N m\"\n\
                     [motor.m]\nshaft = \"s\"\n[disturbance.load]\nshaft = \"s\"\n\
                     [[identification.extra]]\nkind = \"stribeck\"\nfriction = \"s\"\n\
                     [[identification.extra]]\nkind = \"load\"\nfriction = \"s\"\ntorque = \"load\"\n";

/// Stribeck friction with its speed, and the loss in proportion to a torque: found, and chosen by cross-validation where they are there.
#[test]
fn extra_terms_and_their_choice() {
    let stribeck = |w: f64| 0.3 + 0.25 * (-(w / 1.7) * (w / 1.7)).exp();
    let log = shaft_log(11, |w, load| 0.02 * w + (stribeck(w) + 0.04 * load.abs()) * w.signum());
    let mut settings = IdentifySettings { compare: true, ..IdentifySettings::default() };
    let all = found(SHAFT, vec![log], &settings);
    for (name, truth) in [
        ("s.damping", 0.02),
        ("s.friction", 0.3),
        ("s.stribeck", 0.25),
        ("s.stribeck_speed", 1.7),
        ("s.load_loss", 0.04),
    ] {
        near(&all, name, truth, 4.0);
        assert!(one(&all, name).standard_error.unwrap() < 0.3 * truth, "{:?}", one(&all, name));
    }
    // Stribeck friction goes into a file as the torque at which it breaks away.
    let breakaway = all.for_file.values.iter().find(|one| one.name == "s.breakaway").expect("it is told");
    assert!(
        (breakaway.value - one(&all, "s.friction").value.unwrap() - one(&all, "s.stribeck").value.unwrap()).abs()
            < 1e-12
    );
    assert!(all.for_file.values.iter().any(|one| one.name == "s.stribeck_speed" && one.interval.is_some()));
    assert!(all.for_file.omissions.iter().any(|why| why.starts_with("s.load_loss")), "{:?}", all.for_file.omissions);
    let chosen = all.candidates.iter().find(|one| one.chosen).expect("one is chosen");
    assert_eq!(chosen.name, "with all extra terms");
    // Where neither is there, the plain model is, and the terms come out as nothing.
    let plain_log = shaft_log(12, |w, _| 0.02 * w + 0.3 * w.signum());
    let plain = found(SHAFT, vec![plain_log.clone()], &settings);
    assert_eq!(plain.candidates.iter().find(|one| one.chosen).expect("one").name, "as requested, no extra terms");
    near(&plain, "s.load_loss", 0.0, 4.0);
    // Named parameters leave out extra terms that are not named.
    settings.parameters = vec!["s.friction".into(), "s.damping".into()];
    let two = found(SHAFT, vec![plain_log], &settings);
    assert_eq!(two.parameters.len(), 2);
}

/// A Stribeck speed that is given is no parameter of the fit, whatever the method; and one whose torque stands at its bound, zero, is not
/// determined.
#[test]
fn an_explicit_stribeck_speed_is_not_fitted() {
    let stribeck = |w: f64| 0.3 + 0.25 * (-(w / 1.7) * (w / 1.7)).exp();
    let log = shaft_log(14, |w, _| 0.02 * w + stribeck(w) * w.signum());
    let plain = SHAFT.split("[[identification.extra]]").next().expect("text");
    let term = "[[identification.extra]]\nkind = \"stribeck\"\nfriction = \"s\"\n";
    let explicit_speed = format!("{plain}{term}speed = \"1.7 rad/s\"\n");
    let options = |method: &str| IdentifySettings {
        variant: None,
        ..settings(&["s.damping", "s.friction", "s.stribeck"], method)
    };
    for method in ["steady", "dynamic"] {
        let all = found(&explicit_speed, vec![log.clone()], &options(method));
        for (name, truth) in [("s.damping", 0.02), ("s.friction", 0.3), ("s.stribeck", 0.25)] {
            near(&all, name, truth, 4.0);
            assert!(one(&all, name).interval.is_some(), "{method}: {:?}", one(&all, name));
        }
        assert!(all.verdict().text.starts_with("All 3 parameters are determined"), "{}", all.verdict().text);
        let speed = one(&all, "s.stribeck_speed");
        assert_eq!((speed.value, speed.standard_error, speed.remark.as_str()), (Some(1.7), None, "given"), "{method}");
        assert!(all.for_file.values.iter().any(|one| one.name == "s.stribeck_speed" && one.value == 1.7), "{method}");
    }
    let none = shaft_log(15, |w, _| 0.02 * w + (0.3 - 0.2 * (-(w / 1.7) * (w / 1.7)).exp()) * w.signum());
    let bounded = format!("[identification]\nnonnegative = [\"s.stribeck\"]\n{plain}{term}");
    let nonnegative_stribeck = IdentifySettings { variant: None, ..settings(&["s.damping", "s.stribeck"], "dynamic") };
    let all = found(&bounded, vec![none], &nonnegative_stribeck);
    assert_eq!(one(&all, "s.stribeck").value, Some(0.0));
    assert_eq!(one(&all, "s.stribeck_speed").standard_error, Some(f64::INFINITY));
    assert!(all.for_file.values.iter().all(|one| one.name != "s.stribeck_speed"), "{:?}", all.for_file.values);
}

/// Candidates are compared on one scale and on the same windows, whatever the file guesses: an inertia that the log does not have, a
/// breakaway torque, a clock that jumps back; a bound on a parameter concerns the models that have it.
#[test]
fn candidates_are_compared_on_equal_terms() {
    let log = shaft_log(31, |w, _| 0.02 * w + 0.3 * w.signum());
    let compared = |source: &str, logs: &[String]| {
        let options = IdentifySettings {
            parameters: vec!["s.inertia".into(), "s.damping".into(), "s.friction".into()],
            method: Some("dynamic".into()),
            compare: true,
            ..IdentifySettings::default()
        };
        found(source, logs.to_vec(), &options).candidates
    };
    let plain = SHAFT.split("[[identification.extra]]").next().expect("text").to_string();
    let error = |all: &[kardan::results::Candidate], name: &str| {
        all.iter().find(|one| one.name == name).unwrap_or_else(|| panic!("no {name} in {all:?}")).error.unwrap().mean
    };
    let all = compared(&plain, std::slice::from_ref(&log));
    let whole = error(&all, "as requested, no extra terms");
    assert!(error(&all, "without Coulomb friction") > 2.0 * whole && error(&all, "without damping") > 2.0 * whole);
    // What the file says of the inertia is fitted anyway.
    let other = compared(&plain.replace("0.01 kg m^2", "0.02 kg m^2"), std::slice::from_ref(&log));
    for one in &all {
        let ratio = error(&other, &one.name)
            / error(&other, "as requested, no extra terms")
            / (one.error.unwrap().mean / whole);
        assert!((ratio - 1.0).abs() < 0.02, "{}: {ratio}", one.name);
    }
    // Without friction there is no breakaway either.
    let sticky = plain.replace(
        "friction = \"0.3 N m\"",
        "friction = \"0.3 N m\"\nbreakaway = \"0.6 N m\"\nstribeck_speed = \"40 rad/s\"",
    );
    let all_sticky = compared(&sticky, std::slice::from_ref(&log));
    let (bare, stuck) = (error(&all, "without Coulomb friction"), error(&all_sticky, "without Coulomb friction"));
    assert!((stuck / bare - 1.0).abs() < 0.05, "{stuck} {bare}");
    // The same recording twice, the clock beginning anew, is compared as two files are.
    let rows: String = log.lines().skip(2).map(|line| format!("{line}\n")).collect();
    let repeated = compared(&plain, &[format!("{log}{rows}")]);
    let both = compared(&plain, &[log.clone(), log.clone()]);
    for (one, other) in repeated.iter().zip(&both) {
        assert!((one.error.unwrap().mean / other.error.unwrap().mean - 1.0).abs() < 1e-9, "{one:?} {other:?}");
        assert!((one.error.unwrap().spread / other.error.unwrap().spread - 1.0).abs() < 1e-6, "{one:?} {other:?}");
    }
    let bounded = format!("[identification]\nnonnegative = [\"s.friction\"]\n{plain}");
    assert_eq!(compared(&bounded, std::slice::from_ref(&log)).len(), all.len());
    let one_of_them = IdentifySettings { parameters: vec![" s.damping".into()], ..IdentifySettings::default() };
    assert_eq!(found(&bounded, vec![log.clone()], &one_of_them).parameters.len(), 1);
}

/// A guess of an inertia that the log does not have changes the noise that accelerations would bring, but not which model is better:
/// with it and without it predictions are the same, and so are their errors.
#[test]
fn a_guess_does_not_choose_the_model() {
    let mut random = Random::new(9);
    let mut log = String::from("t;s.w;m.tau;load.tau\ns;rad/s;N m;N m\n");
    for k in 0..20_000 {
        let t = 0.001 * f64::from(k);
        let w = 20.0 * (0.4 * t).sin().powi(3) + 0.5 * (2.3 * t).sin();
        let tau = 0.02 * w + 0.3 * w.signum() + 0.01 * normal(&mut random);
        let _ = writeln!(log, "{t:.3};{:.6};{tau:.9};0", w + 0.05 * normal(&mut random));
    }
    let plain = SHAFT.split("[[identification.extra]]").next().expect("text");
    let errors = ["0.05 kg m^2", "1e-6 kg m^2"].map(|guess| {
        let source = format!(
            "{}[[identification.candidate]]\nname = \"with\"\nparameters = [\"s.inertia\", \"s.damping\", \"s.friction\"]\n\
             [[identification.candidate]]\nname = \"without\"\nparameters = [\"s.damping\", \"s.friction\"]\n",
            plain.replace("0.01 kg m^2", guess)
        );
        let options = IdentifySettings {
            parameters: vec!["s.inertia".into(), "s.damping".into(), "s.friction".into()],
            method: Some("dynamic".into()),
            compare: true,
            ..IdentifySettings::default()
        };
        let all = found(&source, vec![log.clone()], &options).candidates;
        assert!(all.len() == 2 && all[1].chosen, "{all:?}");
        all[0].error.unwrap().mean / all[1].error.unwrap().mean
    });
    assert!(errors.iter().all(|ratio| (ratio - 1.0).abs() < 0.05), "{errors:?}");
}

/// A parameter at its bound goes into the file as zero: the others were fitted so.
#[test]
fn a_parameter_at_its_bound_is_written() {
    let log = shaft_log(32, |w, _| -0.004 * w + 0.3 * w.signum());
    let bounded = format!(
        "[identification]\nnonnegative = [\"s.damping\"]\nparameters = [\"s.damping\", \"s.friction\"]\n{}",
        SHAFT.split("[[identification.extra]]").next().expect("text")
    );
    let found = found(&bounded, vec![log], &IdentifySettings::default());
    assert_eq!((one(&found, "s.damping").value.unwrap(), found.parameters.len()), (0.0, 2));
    let (text, unwritten) = study::write_values(&bounded, &found).expect("a file");
    assert!(unwritten.is_empty() && text.contains("damping = \"0 N m s/rad\""), "{text}");
}

/// Numbers that no sensor gives are refused, not computed with; a sensor that hardly sees what a parameter acts on is told.
#[test]
fn numbers_out_of_reach() {
    let plain = SHAFT.split("[[identification.extra]]").next().expect("text");
    let log = shaft_log(33, |w, _| 0.02 * w + 0.3 * w.signum());
    let with = |number: &str| {
        let mut lines: Vec<String> = log.lines().map(String::from).collect();
        let cells: Vec<&str> = lines[5000].split(';').collect();
        lines[5000] = format!("{};{};{number};{}", cells[0], cells[1], cells[3]);
        lines.join("\n")
    };
    for number in ["1.7976931348623157e308", "-1e300", "1e160"] {
        // The window that has it may be left out, as any in which a number is missing.
        let files = vec![file("log.csv", with(number))];
        match identify(plain, files, &IdentifySettings::default(), &Silent) {
            Ok(found) => near(&found, "s.damping", 0.02, 4.0),
            Err(wrong) => assert!(wrong[0].message.contains("too large to compute with"), "{number}: {wrong:?}"),
        }
    }
    // A twist of 0.4 mrad under an encoder with 1 mrad of noise: the stiffness comes out too small, and that is said.
    let spring = "[shaft.s]\ninertia = \"0.01 kg m^2\"\n[spring_damper.k]\nshaft_1 = \"s\"\nstiffness = \"5000 N m/rad\"\n\
                  [motor.m]\nshaft = \"s\"\n";
    let stiff = |noise: f64| {
        let mut random = Random::new(4);
        let mut out = String::from("t,s.phi,m.tau\ns,rad,N m\n");
        for k in 0..20_000 {
            let t = 0.001 * f64::from(k);
            let phi = 5.7e-4 * (2.0 * t).sin();
            let tau = 5000.0 * phi - 0.04 * phi;
            let _ = writeln!(
                out,
                "{t:.3},{:.9},{:.9}",
                phi + noise * normal(&mut random),
                tau + 0.01 * normal(&mut random)
            );
        }
        out
    };
    let options = IdentifySettings {
        parameters: vec!["k.stiffness".into()],
        method: Some("dynamic".into()),
        ..IdentifySettings::default()
    };
    let (loud, quiet) = (found(spring, vec![stiff(1e-3)], &options), found(spring, vec![stiff(1e-6)], &options));
    assert!(loud.warnings.iter().any(|one| one.contains("k.stiffness acts on is sensor noise")), "{:?}", loud.warnings);
    assert!(quiet.warnings.is_empty(), "{:?}", quiet.warnings);
    near(&quiet, "k.stiffness", 5000.0, 4.0);
}

/// Units in the name of the time; the time that the file names, whatever its letters.
#[test]
fn the_time_is_found() {
    let plain = SHAFT.split("[[identification.extra]]").next().expect("text");
    let log = shaft_log(34, |w, _| 0.02 * w + 0.3 * w.signum());
    let rows = || log.lines().skip(2).map(|line| line.split_once(';').expect("columns"));
    let in_ms: String = "time_ms;s.w;m.tau;load.tau\n".to_string()
        + &rows()
            .map(|(t, cells)| format!("{};{cells}\n", t.parse::<f64>().expect("a time") * 1e3))
            .collect::<String>();
    let found_ms = found(plain, vec![in_ms], &IdentifySettings::default());
    near(&found_ms, "s.damping", 0.02, 4.0);
    assert!((found_ms.logs[0].span.unwrap().end - 19.999).abs() < 1e-6);
    let two: String = "Clock;t;s.w;m.tau;load.tau\n".to_string()
        + &rows()
            .map(|(t, cells)| format!("{t};{};{cells}\n", 7.0 * t.parse::<f64>().expect("a time")))
            .collect::<String>();
    let named = format!("[log.bench]\ntime = \"clock\"\n{plain}");
    let found_two = found(&named, vec![two], &IdentifySettings::default());
    assert!((found_two.logs[0].span.unwrap().end - 19.999).abs() < 1e-6, "{:?}", found_two.logs[0].span);
}

/// Outliers: squares follow them, the bisquare does not.
#[test]
fn outliers() {
    let log = shaft_log(21, |w, _| 0.02 * w + 0.3 * w.signum());
    let spoiled: String = log
        .lines()
        .enumerate()
        .map(|(k, line)| {
            // A sensor that sticks at 40 N m for a twentieth of a second each half second, where the speed is above zero.
            let mut cells: Vec<&str> = line.split(';').collect();
            if k > 2 && k % 500 < 50 && !cells[1].starts_with('-') {
                cells[2] = "40";
                cells.join(";") + "\n"
            } else {
                line.to_string() + "\n"
            }
        })
        .collect();
    let options = |loss: &str| IdentifySettings {
        parameters: vec!["s.friction".into(), "s.damping".into()],
        loss: Some(loss.into()),
        method: Some("dynamic".into()),
        ..IdentifySettings::default()
    };
    let squares = found(SHAFT, vec![spoiled.clone()], &options("squares"));
    let robust = found(SHAFT, vec![spoiled], &options("bisquare"));
    assert!((one(&squares, "s.friction").value.unwrap() - 0.3).abs() > 0.1, "{:?}", one(&squares, "s.friction"));
    near(&robust, "s.friction", 0.3, 4.0);
    near(&robust, "s.damping", 0.02, 4.0);
    assert!(one(&robust, "s.friction").standard_error.unwrap() < 0.003 && robust.outliers > 20);
    let huber = found(SHAFT, vec![shaft_log(22, |w, _| 0.02 * w + 0.3 * w.signum())], &options("huber"));
    near(&huber, "s.friction", 0.3, 4.0);
}

/// A bound holds, and the others are those of the problem without that parameter.
#[test]
fn bounds() {
    let log = shaft_log(31, |w, _| -0.01 * w + 0.3 * w.signum());
    let options = |parameters: &[&str]| IdentifySettings {
        parameters: parameters.iter().map(|name| name.to_string()).collect(),
        method: Some("dynamic".into()),
        ..IdentifySettings::default()
    };
    let free = found(SHAFT, vec![log.clone()], &options(&["s.damping", "s.friction"]));
    near(&free, "s.damping", -0.01, 4.0);
    let bounded = SHAFT.to_string() + "[identification]\nnonnegative = [\"s.damping\"]\n";
    let bounded_fit = found(&bounded, vec![log.clone()], &options(&["s.damping", "s.friction"]));
    assert_eq!(
        (one(&bounded_fit, "s.damping").value.unwrap(), one(&bounded_fit, "s.damping").remark.as_str()),
        (0.0, "at its bound, zero")
    );
    let undamped = SHAFT.replace("damping = \"0.02 N m s/rad\"", "damping = \"0 N m s/rad\"");
    let friction_only = found(&undamped, vec![log], &options(&["s.friction"]));
    let (a, b) = (one(&bounded_fit, "s.friction").value.unwrap(), one(&friction_only, "s.friction").value.unwrap());
    assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
}

/// A key that the model file does not give is found all the same; the sense of a sensor, its unit, its zero and its clock are put right.
#[test]
fn log_channels_are_described_in_the_file() {
    let source = "[shaft.s]\ninertia = \"0.01 kg m^2\"\n[motor.m]\nshaft = \"s\"\n\
        [identification]\nparameters = [\"s.damping\", \"s.friction\"]\nmethod = \"dynamic\"\n\
        [log.speed]\nfile = \"*speed*\"\n[[log.speed.channel]]\nsignal = \"s.w\"\ncolumn = \"Drehzahl\"\nunit = \"rpm\"\nfactor = -1\n\
        [log.force]\nfile = \"*force*\"\ntime = \"clock\"\ntime_unit = \"ms\"\ntime_offset = \"-2 s\"\n\
        [[log.force.channel]]\nsignal = \"m.tau\"\nnumber = 2\nscale = \"0.5 N m\"\nzero_samples = 200\n";
    let (mut speed, mut force) = (String::from("Zeit;Drehzahl\ns;1/min\n"), String::from("clock\tcell\nms\tV\n"));
    let mut random = Random::new(2);
    let w = |t: f64| if t < 1.0 { 0.0 } else { 30.0 * ((t - 1.0) * 0.8).sin() };
    for k in 0..8000 {
        let t = 0.001 * f64::from(k);
        let rpm = -w(t) * 30.0 / std::f64::consts::PI;
        let _ = writeln!(speed, "{};{}", format!("{t:.3}").replace('.', ","), format!("{rpm:.7}").replace('.', ","));
    }
    // Another rate, another clock, an offset of 1.3 V.
    for k in 0..2600 {
        let t = 0.003 * f64::from(k);
        let a = if t < 1.0 { 0.0 } else { 24.0 * ((t - 1.0) * 0.8).cos() };
        let sign = if t < 1.0 { 0.0 } else { w(t).signum() };
        let tau = 0.01 * a + 0.004 * w(t) + 0.2 * sign + 0.002 * normal(&mut random);
        let _ = writeln!(force, "{:.3}\t{:.6}", 1000.0 * (t + 2.0), tau / 0.5 + 1.3);
    }
    let files = vec![file("force.txt", force), file("speed.txt", speed)];
    let found = identify(source, files, &IdentifySettings::default(), &Silent)
        .unwrap_or_else(|wrong| panic!("{}", plain(source, &wrong)));
    near(&found, "s.damping", 0.004, 4.0);
    near(&found, "s.friction", 0.2, 4.0);
    assert!(one(&found, "s.damping").model_value.is_none());
    assert_eq!(found.logs.len(), 2);
    assert!(found.windows.sticking > 0);
}

/// Gaps, a clock that jumps back, rows twice: told, and the rest is used; a slow channel need not be filled up.
#[test]
fn gaps_and_jumps() {
    let mut log = String::from("time,s.w,m.tau,load.tau\n");
    let mut random = Random::new(9);
    let mut add = |from: f64, count: u32, log: &mut String| {
        for k in 0..count {
            let t = from + 0.001 * f64::from(k);
            let w = 5.0 + 3.0 * (2.0 * t).sin();
            let tau = 0.01 * 6.0 * (2.0 * t).cos() + 0.02 * w + 0.3 - 1.0 + 0.002 * normal(&mut random);
            // The load is logged with a tenth of the rate.
            let load = if k % 10 == 0 { "1" } else { "" };
            let _ = writeln!(log, "{t},{w},{tau},{load}");
        }
    };
    add(0.0, 3000, &mut log);
    add(4.5, 2000, &mut log);
    let repeated = log.lines().last().expect("rows").to_string() + "\n";
    log += &repeated;
    add(1.0, 3000, &mut log);
    let options = IdentifySettings {
        parameters: vec!["s.damping".into(), "s.friction".into()],
        method: Some("dynamic".into()),
        window: Some(0.1),
        ..IdentifySettings::default()
    };
    let found = found(SHAFT, vec![log], &options);
    near(&found, "s.damping", 0.02, 4.0);
    near(&found, "s.friction", 0.3, 4.0);
    let remarks = found.logs[0].remarks.join("; ");
    assert!(remarks.contains("a gap of 1.501 s after 2.999 s"), "{remarks}");
    assert!(remarks.contains("the clock jumps back by 5.499 s at row 5002 (1.000 s)"), "{remarks}");
    assert!(remarks.contains("1 rows repeat the time"), "{remarks}");
}

/// Into the file and back: the values with their intervals are tolerances of the model.
#[test]
fn written_and_read_again() {
    let found = found(drive(), vec![csv(&grid(0.6), 13, |_, _| 0.0)], &settings(&SIX, "steady"));
    let (text, unwritten) =
        study::write_values(drive(), &found).unwrap_or_else(|wrong| panic!("{}", plain(drive(), &wrong)));
    assert_eq!(unwritten, Vec::<String>::new());
    let lines = |text: &str| text.lines().filter(|line| line.trim_start().starts_with('#')).count();
    assert_eq!(lines(&text), lines(drive()), "comments stay");
    let (document, diagnostics) = read(&text);
    // The variants differ in parameters that values found have taken the place of: that is told.
    assert!(diagnostics.iter().all(|one| one.code == "parameter::unused"), "{}", plain(&text, &diagnostics));
    let settings = document.variant_settings();
    let variant = settings.iter().find(|one| one.name == "position-friction").expect("a variant");
    let tolerances = document.tolerances(&variant.settings);
    for name in SIX {
        let one = one(&found, name);
        // A friction is an entry of [parameters] there.
        let entry = match name.split_once('.') {
            Some((shaft, "friction")) => format!("friction_{shaft}"),
            _ => name.to_string(),
        };
        let tolerance = tolerances.iter().find(|other| other.parameter == entry);
        let Some(tolerance) = tolerance else {
            // It is varied in the file, so that the key itself was written.
            assert!(tolerances.iter().any(|other| other.parameter == name), "{name}");
            continue;
        };
        let width = one.interval.unwrap().upper - one.interval.unwrap().lower;
        assert!((tolerance.nominal.to_f64() - one.value.unwrap()).abs() < 0.02 * width, "{name}");
        assert!((tolerance.lower.to_f64() - one.interval.unwrap().lower).abs() < 0.02 * width, "{name}");
        assert!((tolerance.upper.to_f64() - one.interval.unwrap().upper).abs() < 0.02 * width, "{name}");
    }
}

/// What cannot be is said, with what to do.
#[test]
fn nonsense_is_refused() {
    let good = shaft_log(41, |w, _| 0.02 * w);
    let plain_settings = IdentifySettings::default();
    let assert_refused = |source: &str, log: &str, settings: &IdentifySettings, fragments: &[&str]| {
        let text = refused(source, vec![("my.csv", log.to_string())], settings);
        fragments.iter().for_each(|word| assert!(text.contains(word), "{word}: {text}"));
    };
    assert_refused(SHAFT, "", &plain_settings, &["my.csv", "empty"]);
    assert_refused(SHAFT, "time,speed\n0,1\n1,2\n", &plain_settings, &["no channel", "speed", "s.w"]);
    assert_refused(SHAFT, "x,s.w,m.tau\n0,1,1\n1,2,1\n", &plain_settings, &["time", "sample_time"]);
    assert_refused(SHAFT, "time,m.tau\n0,1\n1,2\n", &plain_settings, &["degrees of freedom", "log"]);
    assert_refused(SHAFT, "time,s.w\n0,1\n1,2\n", &plain_settings, &["no torque"]);
    assert_refused(
        SHAFT,
        "time,s.w,m.tau,load.tau\ns,N m,N m,N m\n0,1,1,1\n1,2,2,2\n",
        &plain_settings,
        &["unit", "s.w"],
    );
    assert_refused(SHAFT, "time,s.w,m.tau,load.tau\n0,1,1,1\n0.1,2,1,1\n", &plain_settings, &["too few", "window"]);
    let options = |names: &[&str]| IdentifySettings {
        parameters: names.iter().map(|name| name.to_string()).collect(),
        ..IdentifySettings::default()
    };
    assert_refused(SHAFT, &good, &options(&["s.dampin"]), &["s.dampin", "did you mean `s.damping`"]);
    assert_refused(SHAFT, &good, &options(&["m.tau"]), &["m.tau"]);
    assert_refused(SHAFT, &good, &options(&["s.damping", "s.damping"]), &["same coefficient"]);
    assert_refused(GEARS, "time,a.w,m.tau\n0,1,1\n", &options(&["g.ratio"]), &["g.ratio"]);
    let ratio = GEARS.replace("ratio = 3", "ratio = \"r\"") + "[parameters]\nr = 3\n";
    assert_refused(&ratio, "time,a.w,m.tau\n0,1,1\n", &options(&["r"]), &["linearly"]);
    let no_variant = IdentifySettings { variant: Some("x".into()), ..IdentifySettings::default() };
    assert_refused(SHAFT, &good, &no_variant, &["no variant `x`"]);
    let width = IdentifySettings { window: Some(f64::NAN), ..IdentifySettings::default() };
    assert_refused(SHAFT, &good, &width, &["window"]);
    let two = format!("{SHAFT}[log.a]\nfile = \"a*\"\n[log.b]\nfile = \"b*\"\n");
    let unpaired = refused(
        &two,
        vec![("a1.csv", good.clone()), ("a2.csv", good.clone()), ("b1.csv", good.clone())],
        &plain_settings,
    );
    assert!(unpaired.contains("2 of `a`, 1 of `b`"), "{unpaired}");
    let unknown = refused(&two, vec![("c.csv", good.clone())], &plain_settings);
    assert!(unknown.contains("describes `c.csv`"), "{unknown}");
    let ambiguous = refused(&two, vec![("a.csv", good.clone()), ("b.csv", good.clone())], &plain_settings);
    assert!(ambiguous.contains("in two channels"), "{ambiguous}");
    let differ = refused(
        SHAFT,
        vec![("a.csv", good.clone()), ("b.csv", "time,s.w,m.tau\n0,1,1\n1,2,1\n".into())],
        &plain_settings,
    );
    assert!(differ.contains("lacks `load.tau`"), "{differ}");
    let none = refused(SHAFT, vec![], &plain_settings);
    assert!(none.contains("no log"), "{none}");
    let channel = |keys: &str| format!("{SHAFT}[log.a]\n[[log.a.channel]]\nsignal = \"s.w\"\n{keys}\n");
    assert_refused(&channel("column = \"spead\""), &good, &plain_settings, &["no column", "spead"]);
    assert_refused(&channel("number = 99"), &good, &plain_settings, &["no column number 99"]);
    assert_refused(&channel(""), &good, &plain_settings, &["neither `column` nor `number`"]);
    assert_refused(&channel("column = \"s.w\"\nunit = \"furlong\""), &good, &plain_settings, &["furlong"]);
    assert_refused(
        &channel("column = \"s.w\"\nscale = \"2 N m\""),
        &good,
        &plain_settings,
        &["expected an angular velocity"],
    );
    // A log that breaks off: what is before counts, and it is said.
    let broken = good[..good.len() - 10].to_string();
    let found = found(SHAFT, vec![broken], &options(&["s.damping"]));
    assert!(!found.logs[0].remarks.is_empty(), "{:?}", found.logs[0]);
}

/// Many at once on the pool in which readers share their work: each comes to its end, with the same numbers as alone.
#[test]
fn many_at_once() {
    use rayon::prelude::*;
    let log = shaft_log(51, |w, _| 0.02 * w + 0.3 * w.signum());
    let options = IdentifySettings { parameters: vec!["s.friction".into()], ..IdentifySettings::default() };
    let single_run = one(&found(SHAFT, vec![log.clone()], &options), "s.friction").value.unwrap();
    let all: Vec<f64> = (0..16)
        .into_par_iter()
        .map(|_| one(&found(SHAFT, vec![log.clone()], &options), "s.friction").value.unwrap())
        .collect();
    assert!(all.iter().all(|value| *value == single_run), "{single_run} {all:?}");
}

/// A recording that was stopped: logs of a few windows, sound and cut in the middle of a row, end with an interval or with a word.
#[test]
fn logs_cut_at_every_length() {
    let (source, settings) = (builtin("harmonic-drive-bench").unwrap().source, study::BenchSettings::default());
    let bench = study::prepare_bench(&study::Project::open(source), &settings).unwrap();
    let whole = String::from_utf8(kardan::export::csv(&bench.log(0, &mut |_| None))).unwrap();
    let lines: Vec<&str> = whole.split_inclusive('\n').take(1000).collect();
    let (mut reported, mut no_interval) = (0, 0);
    for parameters in [&["wg.damping"][..], &[]] {
        for window in [0.4, 0.05] {
            let options = IdentifySettings { window: Some(window), variant: None, ..self::settings(parameters, "") };
            for count in (1..lines.len()).step_by(7).chain([500]) {
                let mut log = lines[..count].concat();
                // Every other one ends in the middle of a number.
                log.truncate(log.len() - if count % 2 == 0 { 0 } else { 9 });
                let Ok(found) = identify(source, vec![file("log.csv", log)], &options, &Silent) else { continue };
                for one in &found.parameters {
                    let inside = one.interval.is_none_or(|it| (it.lower..=it.upper).contains(&one.value.unwrap()));
                    assert!(
                        one.interval.is_none_or(|it| it.lower.is_finite() && it.upper.is_finite()),
                        "{count}: {one:?}"
                    );
                    assert!(inside, "{count}: {one:?}");
                    assert!(one.interval.is_some() || !one.remark.is_empty(), "{count}: {one:?}");
                    reported += usize::from(one.interval.is_some());
                    no_interval += usize::from(one.interval.is_none());
                }
                let Verdict { sound, text: verdict } = found.verdict();
                assert!(!sound || found.parameters.iter().all(|one| one.interval.is_some()), "{verdict}");
            }
        }
    }
    assert!(reported > 20 && no_interval > 20, "{reported} intervals, {no_interval} parameters without");
}

/// What stands against a result stands in its first sentence.
#[test]
fn the_verdict_names_damage_and_warnings() {
    let source = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
    let rows = |count: u32| -> Vec<String> {
        let row = |k: u32| {
            let speed = f64::from(1 + k / 500);
            format!("{},{speed},{}\n", 0.001 * f64::from(k), 2.0 * speed + 1e-3 * f64::from(k * 7919 % 101))
        };
        std::iter::once("time,a.w,m.tau\ns,rad/s,N m\n".into()).chain((0..count).map(row)).collect()
    };
    let verdict = |rows: Vec<String>| {
        let found = found(source, vec![rows.concat()], &IdentifySettings::default());
        let Verdict { sound, text: verdict } = found.verdict();
        let json = kardan::export::identification_json(&found);
        assert!(json.contains(&format!("\"reliable\":{sound}")), "{json}");
        (sound, verdict)
    };
    assert!(verdict(rows(4000)).0);
    let mut cut = rows(4000);
    cut.last_mut().unwrap().truncate(7);
    let mut odd = rows(4000);
    odd[2000] = "~~~ restarted ~~~\n".into();
    let mut back = rows(4000);
    back.extend(rows(1000).into_iter().skip(1));
    let mut still = rows(4000);
    let again = still[1000].clone();
    still.insert(1000, again);
    for (rows, message) in [
        (cut, "from a log that is damaged (log-0.csv"),
        (odd, "1 row is left out"),
        (back, "the clock of log-0.csv jumps back once"),
        (still, "does not advance or is missing in 1 rows"),
    ] {
        let (sound, verdict) = verdict(rows);
        assert!(!sound && verdict.contains(message), "{message}: {verdict}");
    }
}
