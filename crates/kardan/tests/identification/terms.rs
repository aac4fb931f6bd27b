//! Terms beyond those of a model, found back in logs made here with known truth; and what `--suggest` makes of logs in which a term is
//! there, and of logs in which it is not.

use std::fmt::Write;

use kardan::diagnostics::plain;
use kardan::identify::{FitOptions, Samples, Where, cross_validate, fit};
use kardan::model::builtin;
use kardan::num::Random;
use kardan::results::{Identification, IdentifiedParameter, Suggestions};
use kardan::study::{self, IdentifySettings, LogFile, Silent, identify};
use kardan::tables::read::in_memory;

/// A shaft that turns both ways.
struct At {
    time: f64,
    angle: f64,
    speed: f64,
}

/// A log of 30 s: `J a` of 0.01 kg m² and what a function adds, with noise of 5 mN m.
fn log(seed: u64, torque: impl Fn(&At) -> f64) -> String {
    let mut out = String::from("time,s.phi,m.tau\ns,rad,N m\n");
    let mut random = Random::new(seed);
    for k in 0..30_000 {
        let time = 0.001 * f64::from(k);
        let (slow, fast) = (0.8 * time, 2.3 * time);
        let speed = 20.0 * slow.sin() + 4.0 * fast.sin();
        let angle = 25.0 * (1.0 - slow.cos()) + 4.0 / 2.3 * (1.0 - fast.cos());
        let acceleration = 16.0 * slow.cos() + 9.2 * fast.cos();
        let own = 0.01 * acceleration + torque(&At { time, angle, speed });
        let _ = writeln!(out, "{time:.3},{angle:.9},{:.9}", own + 0.005 * random.normal());
    }
    out
}

/// Damping and Coulomb friction of the shaft.
fn plain_torque(at: &At) -> f64 {
    0.02 * at.speed + 0.3 * at.speed.signum()
}

const SHAFT: &str = "[shaft.s]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.02 N m s/rad\"\nfriction = \"0.3 N m\"\n\
                     [motor.m]\nshaft = \"s\"\n";

fn found(source: &str, logs: &[String], suggest: bool) -> Identification {
    let files = logs.iter().enumerate();
    let files = files
        .map(|(k, text)| LogFile { name: format!("log-{}.csv", k + 1), bytes: in_memory(text.clone().into_bytes()) });
    let settings = IdentifySettings { method: Some("dynamic".into()), suggest, ..IdentifySettings::default() };
    identify(source, files.collect(), &settings, &Silent).unwrap_or_else(|wrong| panic!("{}", plain(source, &wrong)))
}

fn one<'a>(all: &'a [IdentifiedParameter], name: &str) -> &'a IdentifiedParameter {
    all.iter().find(|one| one.name == name).unwrap_or_else(|| panic!("no {name} in {all:?}"))
}

/// Within four standard errors of the truth, which are so small that it is told.
fn near(found: &Identification, name: &str, truth: f64) {
    let one = one(&found.parameters, name);
    let (value, error) = (one.value.unwrap(), one.standard_error.unwrap());
    assert!(((value - truth) / error).abs() < 4.0, "{name}: {value} ± {error} instead of {truth}");
    assert!(error < 0.2 * truth.abs(), "{name}: {value} ± {error}");
}

fn extra(keys: &str) -> String {
    format!("{SHAFT}[[identification.extra]]\n{}\n", keys.replace("; ", "\n"))
}

#[test]
fn friction_by_sense_speed_and_time() {
    let source = extra("kind = \"friction_asymmetry\"; friction = \"s\"")
        + "[[identification.extra]]\nkind = \"quadratic\"\nfriction = \"s\"\n\
           [[identification.extra]]\nkind = \"damping_asymmetry\"\nfriction = \"s\"\n\
           [[identification.extra]]\nkind = \"drift\"\nfriction = \"s\"\n";
    let torque = |at: &At| {
        let sign = at.speed.signum();
        plain_torque(at) + 0.05 + 0.003 * at.speed.abs() + 0.0004 * at.speed * at.speed.abs() + 0.002 * at.time * sign
    };
    let found = found(&source, &[log(1, torque)], false);
    for (name, truth, unit) in [
        ("s.inertia", 0.01, "kg m^2"),
        ("s.damping", 0.02, "N m s/rad"),
        ("s.friction", 0.3, "N m"),
        ("s.friction_asymmetry", 0.05, "N m"),
        ("s.damping_asymmetry", 0.003, "N m s/rad"),
        ("s.quadratic_damping", 0.0004, "N m s^2/rad^2"),
        ("s.friction_drift", 0.002, "N m/s"),
    ] {
        near(&found, name, truth);
        assert_eq!(one(&found.parameters, name).unit, unit, "{name}");
    }
    assert!(found.tests.iter().all(|test| test.probability > 1e-3), "{:?}", found.tests);
    // Those that a law can say go into the model file, and one that changes with the log does not.
    assert_eq!(found.for_file.omissions.len(), 1, "{:?}", found.for_file.omissions);
    assert_eq!(found.for_file.terms.len(), 3, "{:?}", found.for_file.terms);
}

/// An offset of the torque sensor is what it reads too much; the shaft turns it into a constant torque the other way round than friction.
#[test]
fn an_offset_of_a_torque_sensor() {
    let source = extra("kind = \"offset\"; torque = \"m\"");
    let found = found(&source, &[log(2, |at| plain_torque(at) + 0.04)], false);
    near(&found, "m.offset", 0.04);
    near(&found, "s.friction", 0.3);
    // Both at once act alike here, and that is told.
    let both = source + "[[identification.extra]]\nkind = \"friction_asymmetry\"\nfriction = \"s\"\n";
    let found = self::found(&both, &[log(2, |at| plain_torque(at) + 0.04)], false);
    let reported = found.unidentifiable.practically.join("; ");
    assert!(reported.contains("m.offset") && reported.contains("s.friction_asymmetry"), "{reported}");
}

/// A torque over the angle and friction over the angle, in windows that hold more than one of their periods: the harmonics pass the filter
/// that the torque passes.
#[test]
fn harmonics_of_the_angle() {
    let source = extra("kind = \"cogging\"; friction = \"s\"; order = 6")
        + "[[identification.extra]]\nkind = \"ripple\"\nfriction = \"s\"\norder = \"1/2\"\n";
    let torque = |at: &At| {
        let (six, half) = (6.0 * at.angle, 0.5 * at.angle);
        plain_torque(at) + 0.06 * six.cos() - 0.04 * six.sin()
            + at.speed.signum() * (0.03 * half.cos() + 0.05 * half.sin())
    };
    let found = found(&source, &[log(3, torque)], false);
    for (name, truth) in [
        ("s.cogging_6_cos", 0.06),
        ("s.cogging_6_sin", -0.04),
        ("s.friction_ripple_0.5_cos", 0.03),
        ("s.friction_ripple_0.5_sin", 0.05),
        ("s.damping", 0.02),
        ("s.friction", 0.3),
    ] {
        near(&found, name, truth);
    }
}

/// Friction that differs from log to log: differences from the mean, which is the friction.
#[test]
fn friction_of_each_log() {
    let source = extra("kind = \"recordings\"; friction = \"s\"");
    let frictions = [0.25, 0.34, 0.31];
    let logs: Vec<String> =
        (0..3).map(|k| log(10 + k, |at| 0.02 * at.speed + frictions[k as usize] * at.speed.signum())).collect();
    let found = found(&source, &logs, false);
    near(&found, "s.friction", 0.3);
    near(&found, "s.friction_recordings_1", -0.05);
    near(&found, "s.friction_recordings_2", 0.04);
    assert!(one(&found.parameters, "s.friction_recordings_1").remark.contains("log-1.csv"));
    // Of one log there is nothing to compare: that is said, and the rest is found.
    let single = self::found(&source, &logs[..1], false);
    near(&single, "s.friction", 0.25);
    assert!(
        single.notes.iter().any(|note| note.contains("no two logs have the same direction of rotation")),
        "{:?}",
        single.notes
    );
}

/// Two shafts of 0.01 and 0.02 kg m² with a spring between, whose torque is a function of twist and twist rate; both angles and torques.
fn spring_log(spring: impl Fn(f64, f64) -> f64) -> String {
    let mut text = String::from("time,a.phi,b.phi,m.tau,load.tau\ns,rad,rad,N m,N m\n");
    let mut random = Random::new(5);
    for k in 0..20_000 {
        let time = 0.001 * f64::from(k);
        let (x, y) = (3.0 * time, 1.1 * time);
        let (twist, rate) = (0.02 * x.sin() + 0.004 * y.sin(), 0.06 * x.cos() + 0.0044 * y.cos());
        let twist2 = -0.18 * x.sin() - 0.00484 * y.sin();
        let (b, b2) = (0.5 * y.sin(), -0.5 * 1.21 * y.sin());
        let torque = spring(twist, rate);
        let [m, load] =
            [0.01 * (b2 + twist2) + torque, 0.02 * b2 - torque].map(|exact| exact + 0.005 * random.normal());
        let _ = writeln!(text, "{time:.3},{:.10},{b:.10},{m:.9},{load:.9}", b + twist);
    }
    text
}

const SPRING: &str = "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.02 kg m^2\"\n\
    [spring_damper.k]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"90 N m/rad\"\n\
    [motor.m]\nshaft = \"a\"\n[motor.load]\nshaft = \"b\"\n";

/// A spring behind a backlash: its stiffness, its width, and the error of the width, whichever way round the twist is counted.
#[test]
fn the_width_of_a_backlash() {
    let (stiffness, half) = (100.0, 0.002_f64);
    let source = format!(
        "{SPRING}[identification]\nparameters = [\"k.stiffness\", \"k.backlash_torque\"]\n\
         [[identification.extra]]\nkind = \"backlash\"\nspring = \"k\"\nmin_deflection = \"3 mrad\"\n"
    );
    let spring = |twist: f64, _| if twist.abs() > half { stiffness * (twist - half.copysign(twist)) } else { 0.0 };
    let found = found(&source, &[spring_log(spring)], false);
    near(&found, "k.stiffness", stiffness);
    near(&found, "k.backlash_torque", stiffness * half);
    near(&found, "k.backlash", 2.0 * half);
    assert_eq!(one(&found.parameters, "k.backlash").unit, "rad");
    assert!(found.windows.sticking > 0, "in the backlash nothing is told");
}

/// Hysteresis of a spring, in loops that are run through, is friction along it: its torque differs by twice that between the two ways.
#[test]
fn the_hysteresis_of_a_spring() {
    let source = format!("{SPRING}[identification]\nparameters = [\"k.stiffness\", \"k.friction\"]\n");
    let spring = |twist: f64, rate: f64| 100.0 * twist + 0.15 * rate.signum();
    let found = found(&source, &[spring_log(spring)], false);
    near(&found, "k.stiffness", 100.0);
    near(&found, "k.friction", 0.15);
}

fn suggested(source: &str, logs: &[String]) -> (Identification, Suggestions) {
    let found = found(source, logs, true);
    let suggestions = found.suggestions.clone().expect("they were asked for");
    (found, suggestions)
}

/// What is not there is not suggested: logs of a shaft with damping and friction alone.
#[test]
fn nothing_is_suggested_where_nothing_is_missing() {
    for seed in 100..110 {
        let (found, suggestions) = suggested(SHAFT, &[log(seed, plain_torque)]);
        assert_eq!(suggestions.selected_terms, Vec::<String>::new(), "{seed}: {suggestions:?}");
        assert_eq!(suggestions.text, "");
        assert_eq!(found.tests, suggestions.tests, "{seed}");
        assert_eq!(found.validation, suggestions.validation, "{seed}");
    }
}

/// Each term alone is found among all that are tried, and nothing else; after it the tests hold, and the model file that is told gives
/// the same.
#[test]
fn existing_effects_are_suggested() {
    let sine = |at: &At, order: f64| 0.02 * (order * at.angle + 0.7).sin();
    let logs_of = |torque: &dyn Fn(&At, u64) -> f64, seeds: &[u64]| -> Vec<String> {
        seeds.iter().map(|&seed| log(seed, |at| torque(at, seed))).collect()
    };
    type Missing<'a> = (&'a str, &'a dyn Fn(&At, u64) -> f64, &'a [u64]);
    let cases: [Missing<'_>; 5] = [
        ("s.friction_asymmetry", &|_, _| 0.03, &[21]),
        ("s.quadratic_damping", &|at, _| 0.0005 * at.speed * at.speed.abs(), &[22]),
        ("s.cogging_6", &|at, _| sine(at, 6.0), &[23]),
        ("s.friction_ripple_1", &|at, _| sine(at, 1.0) * at.speed.signum(), &[24]),
        ("s.friction_recordings", &|at, seed| 0.02 * (seed as f64 - 26.0) * at.speed.signum(), &[25, 26, 27]),
    ];
    for (name, torque, seeds) in cases {
        let logs = logs_of(&|at, seed| plain_torque(at) + torque(at, seed), seeds);
        let (found, suggestions) = suggested(SHAFT, &logs);
        assert_eq!(suggestions.selected_terms, [name], "{suggestions:?}");
        assert_eq!(suggestions.failed_tests(), 0, "{name}: {:?}", suggestions.tests);
        let cross_validated = |of: &[kardan::results::Validation]| of[0].cross_validated.unwrap();
        assert!(cross_validated(&suggestions.validation) < cross_validated(&found.validation), "{name}");
        let accepted = suggestions.tested_terms.iter().find(|one| one.selected).expect("one is taken");
        assert!(
            accepted.gain.unwrap() > 2.0 * accepted.gain_spread.unwrap() && accepted.probability.unwrap() < 1e-3,
            "{accepted:?}"
        );
        let again = self::found(&format!("{SHAFT}{}", suggestions.text), &logs, false);
        assert_eq!(again.parameters, suggestions.parameters, "{name}: {}", suggestions.text);
    }
}

/// The torque ripple of the virtual bench, 0.02 N m in 18 periods a turn of `cs` and of `fs`, which another code makes sample by sample: both
/// are suggested, of the right size. What the ripple adds to a motor's torque the balance lacks: the signs are opposite.
#[test]
fn the_ripple_of_the_bench() {
    let source = builtin("harmonic-drive-bench").expect("built in").source;
    let bench = study::prepare_bench(&study::Project::open(source), &study::BenchSettings::default()).unwrap();
    let text = String::from_utf8(kardan::export::csv(&bench.log(0, &mut |_| None))).unwrap();
    let (_, suggestions) = suggested(source, &[text]);
    let mut accepted = suggestions.selected_terms.clone();
    accepted.sort();
    assert_eq!(accepted, ["cs.cogging_18", "fs.cogging_18"], "{:?}", suggestions.tested_terms);
    assert_eq!(suggestions.failed_tests(), 0, "{:?}", suggestions.tests);
    for (name, truth) in [
        ("cs.cogging_18_sin", -0.02),
        ("cs.cogging_18_cos", 0.0),
        ("fs.cogging_18_sin", -0.02),
        ("fs.cogging_18_cos", 0.0),
    ] {
        let one = one(&suggestions.parameters, name);
        let (value, error) = (one.value.unwrap(), one.standard_error.unwrap());
        assert!(((value - truth) / error).abs() < 4.0 && error < 5e-4, "{name}: {value} ± {error} for {truth}");
    }
}

/// A sense that friction differs by and an offset of the sensor are the same here: one is taken, the other told to be the same.
#[test]
fn indistinguishable_terms_are_reported() {
    let (_, suggestions) = suggested(SHAFT, &[log(31, |at| plain_torque(at) + 0.05)]);
    assert_eq!(suggestions.selected_terms, ["s.friction_asymmetry"]);
    let other = suggestions.tested_terms.iter().find(|one| one.term == "m.offset").expect("it was tried");
    assert!(!other.selected && other.verdict.contains("the same torques as s.friction_asymmetry"), "{other:?}");
}

/// What is held out does not enter: whatever stands in a fold, the predictions of that fold stay the same to the last bit.
#[test]
fn held_out_samples_do_not_affect_the_fit() {
    let samples = |spoilt: bool| {
        let mut out = Samples::new(1, 2, 1, 1, 1);
        let mut random = Random::new(3);
        for k in 0..100_u32 {
            let place = Where { log: 0, section: 0, time: f64::from(k), duration: 1.0 };
            let (x, noise) = (f64::from(k) / 50.0 - 1.0, random.normal());
            let room = out.push(place, [&[0.0], &[x], &[0.0]]);
            room.x.copy_from_slice(&[x, 1.0]);
            room.y[0] = 2.0 * x + 1.0 + 0.1 * noise + if spoilt && k % 5 == 2 { 1e3 } else { 0.0 };
            room.covariance[0] = 0.01;
        }
        out
    };
    let folds: Vec<usize> = (0..100).map(|k| k % 5).collect();
    let options = FitOptions::default();
    let [whole, spoilt] = [false, true].map(|spoilt| cross_validate(&samples(spoilt), &folds, &options).unwrap());
    for k in 0..100 {
        assert_eq!(k % 5 == 2, whole[k].to_bits() == spoilt[k].to_bits(), "sample {k}");
    }
}

/// Of one value Wald's test is Student's: its probability is that of the interval that just reaches zero. Of two that are not there it is
/// uniform: below 5 % as often as that, 400 draws with a standard deviation of 1.1 %.
#[test]
fn the_joint_test_is_what_it_says() {
    let samples = |seed: u64| {
        let mut out = Samples::new(1, 3, 2, 1, 1);
        let mut random = Random::new(seed);
        for k in 0..200_u32 {
            let place = Where { log: 0, section: 0, time: f64::from(k), duration: 1.0 };
            let room = out.push(place, [&[0.0], &[0.0], &[0.0]]);
            let (x, y) = (random.normal(), random.normal());
            room.x.copy_from_slice(&[1.0, x, 100.0 * (x + y)]);
            room.y[0] = 1.0 + random.normal();
            room.covariance[0] = 1.0;
        }
        out
    };
    let all: Vec<usize> = (0..200).collect();
    let mut below = 0;
    for seed in 0..400 {
        let found = fit(&samples(seed), &all, &FitOptions::default()).unwrap();
        let single = found.joint_tail(&[1]).unwrap();
        let reach = found.quantile(1, 1.0 - single) * found.standard_errors[1];
        assert!((reach / found.values[1].abs() - 1.0).abs() < 1e-5, "{single} {reach}");
        below += u32::from(found.joint_tail(&[1, 2]).unwrap() < 0.05);
    }
    assert!((8..=32).contains(&below), "{below} of 400");
}

#[test]
fn terms_that_cannot_be_are_refused() {
    let refused = |source: &str, text: &str| {
        let file = LogFile { name: "a.csv".into(), bytes: in_memory(text.as_bytes().to_vec()) };
        match identify(source, vec![file], &IdentifySettings::default(), &Silent) {
            Ok(_) => panic!("that should not work: {source}"),
            Err(wrong) => {
                assert!(wrong.iter().all(|one| one.help.is_some()), "{wrong:?}");
                plain(source, &wrong)
            }
        }
    };
    let whole = log(40, plain_torque);
    for (keys, fragments) in [
        ("kind = \"friction_asymmetry\"", &["needs `friction`"][..]),
        ("kind = \"offset\"", &["needs `torque`", "whose torque was measured"]),
        ("kind = \"offset\"; torque = \"m\"; friction = \"s\"", &["has no `friction`", "has no effect here"]),
        ("kind = \"friction_asymmetry\"; friction = \"s\"; order = 3", &["has no `order`"]),
        ("kind = \"load\"; friction = \"s\"", &["needs `torque`"]),
        ("kind = \"cogging\"; friction = \"s\"", &["needs `order`", "order = 6"]),
        ("kind = \"cogging\"; friction = \"s\"; order = -6", &["order"]),
        ("kind = \"cogging\"; friction = \"s\"; order = 0", &["order"]),
        ("kind = \"backlash\"", &["needs `spring`", "needs `min_deflection`"]),
        ("kind = \"backlash\"; spring = \"s\"; min_deflection = \"1 mrad\"", &["spring"]),
        ("kind = \"backlash\"; spring = \"x\"; min_deflection = \"1 s\"", &["x"]),
        ("kind = \"friction_asymmetry\"; friction = \"q\"", &["q"]),
        ("kind = \"sensor\"; friction = \"s\"", &["sensor"]),
    ] {
        let text = refused(&extra(keys), &whole);
        fragments.iter().for_each(|word| assert!(text.contains(word), "{keys}: {word}: {text}"));
    }
    let repeated = extra("kind = \"friction_asymmetry\"; friction = \"s\"")
        + "[[identification.extra]]\nkind = \"friction_asymmetry\"\nfriction = \"s\"\n";
    assert!(refused(&repeated, &whole).contains("two terms `s.friction_asymmetry`"));
    // Without the angle nothing goes with it.
    let speeds = "time,s.w,m.tau\ns,rad/s,N m\n0,1,1\n0.001,1,1\n";
    let text = refused(&extra("kind = \"cogging\"; friction = \"s\"; order = 6"), speeds);
    assert!(text.contains("depends on the angle of `s`") && text.contains("no angle is in the logs"), "{text}");
    // Whoever asks for a parameter of such a term without it is told which one.
    let request = format!("[identification]\nparameters = [\"s.friction_asymmetry\"]\n{SHAFT}");
    assert!(refused(&request, &whole).contains("kind = \"friction_asymmetry\""));
}

/// What a term found is, written as a law of a torque, is the same again: its coefficient where it is asked for, and the prediction; and a run
/// of the file has it.
#[test]
fn written_terms_are_read_again() {
    let sine = |at: &At| 0.06 * (6.0 * at.angle).cos() - 0.04 * (6.0 * at.angle).sin();
    let torque =
        |at: &At| plain_torque(at) + 0.05 + 0.003 * at.speed.abs() + 0.0004 * at.speed * at.speed.abs() + sine(at);
    let logs = [log(41, torque)];
    let terms = ["friction_asymmetry", "damping_asymmetry", "quadratic", "cogging"];
    let names = "\"s.inertia\", \"s.damping\", \"s.friction\", \"s.friction_asymmetry\", \"s.damping_asymmetry\", \"s.quadratic_damping\", \"s.cogging_6\"";
    let entries: String = terms
        .iter()
        .map(|kind| {
            let order = if *kind == "cogging" { "order = 6\n" } else { "" };
            format!("[[identification.extra]]\nkind = \"{kind}\"\nfriction = \"s\"\n{order}\n")
        })
        .collect();
    // With the list of what is sought, and without.
    for list in [format!("[identification]\nparameters = [{names}]\n"), String::new()] {
        let source =
            format!("{SHAFT}{list}{entries}[scenario]\nduration = \"1 s\"\nsignals = {{ \"m.tau\" = \"1 N m\" }}\n");
        let before = found(&source, &logs, false);
        let (text, unwritten) =
            study::write_values(&source, &before).unwrap_or_else(|reported| panic!("{}", plain(&source, &reported)));
        assert!(unwritten.is_empty(), "{unwritten:?}");
        assert!(!text.contains("identification.extra") && text.matches("[torque.").count() == 4, "{text}");
        assert!(text.contains("law = \"-s_quadratic_damping * s.w * abs(s.w)\""), "{text}");
        let after = found(&text, &logs, false);
        for (name, law) in [
            ("s.friction_asymmetry", "s_friction_asymmetry"),
            ("s.damping_asymmetry", "s_damping_asymmetry"),
            ("s.quadratic_damping", "s_quadratic_damping"),
            ("s.cogging_6_cos", "s_cogging_6_cos"),
            ("s.cogging_6_sin", "s_cogging_6_sin"),
        ] {
            if list.is_empty() {
                continue;
            }
            let (one, other) = (one(&before.parameters, name), one(&after.parameters, law));
            let (value, error) = (one.value.unwrap(), one.standard_error.unwrap());
            assert!(
                (other.value.unwrap() - value).abs() < 0.3 * error,
                "{name}: {other:?} instead of {value} ± {error}"
            );
        }
        for name in ["s.inertia", "s.damping", "s.friction"] {
            let [one, other] = [&before, &after].map(|found| one(&found.parameters, name));
            let (value, error) = (one.value.unwrap(), one.standard_error.unwrap());
            assert!(
                (other.value.unwrap() - value).abs() < 0.3 * error,
                "{name}: {other:?} instead of {value} ± {error}"
            );
        }
        let cross_validated = [&before, &after].map(|found| found.validation[0].cross_validated.unwrap());
        assert!((cross_validated[0] / cross_validated[1] - 1.0).abs() < 0.02, "{cross_validated:?}");
        let run =
            study::run(&text, &study::Settings { runs_only: true, ..study::Settings::default() }, &Silent).unwrap();
        assert!(run.runs[0].series.signal("s_cogging_6_law.tau").is_some());
    }
}

/// `--write` takes the entry of a term out of the file, and no other line: not the keys behind a list in one line, not the next entry, no comment.
#[test]
fn other_parts_of_the_file_stay() {
    let torque = |at: &At| plain_torque(at) + 0.05 + 0.0004 * at.speed * at.speed.abs();
    let logs = [log(43, torque)];
    let names =
        |last: &str| format!("\"s.inertia\", \"s.damping\", \"s.friction\", \"s.friction_asymmetry\", \"{last}\"");
    let scenario = "# the run\n[scenario]\nduration = \"1 s\"\nsignals = { \"m.tau\" = \"1 N m\" }\n";
    let table = |kind: &str, by: &str| {
        format!("{by}[[identification.extra]] # a term\n{by}kind = \"{kind}\"\n{by}friction = \"s\" # of it\n\n")
    };
    let line = |kind: &str| format!("{{ kind = \"{kind}\", friction = \"s\" }}");
    let [quadratic, drift] = ["s.quadratic_damping", "s.friction_drift"];
    let [sense, second, other] = ["friction_asymmetry", "quadratic", "drift"].map(line);
    let keys = "method = \"dynamic\"\nconfidence = 0.9\n\n";
    let cases = [
        (quadratic, format!("extra = [{sense}, {second}]\n{keys}"), format!("extra = []\n{keys}")),
        (drift, format!("extra = [{sense}, {other}]\n{keys}"), format!("extra = [{other}]\n{keys}")),
        (drift, format!("extra = [{other} , {sense}]\n{keys}"), format!("extra = [{other} ]\n{keys}")),
        (
            drift,
            format!("extra = [\n  # why\n  {sense},\n  {other}, # that\n]\n{keys}"),
            format!("extra = [\n  # why\n  {other}, # that\n]\n{keys}"),
        ),
        (
            drift,
            format!("extra = [{other} # one\n, {sense} # two\n]\n{keys}"),
            format!("extra = [{other} # one\n # two\n]\n{keys}"),
        ),
        (quadratic, format!("{keys}{}{}", table("friction_asymmetry", ""), table("quadratic", "")), keys.to_string()),
        (
            drift,
            format!("{keys}{}{}", table("friction_asymmetry", "  "), table("drift", "  ")),
            format!("{keys}{}", table("drift", "  ")),
        ),
    ];
    for (last, input, expected) in cases {
        let source = format!("{SHAFT}[identification]\nparameters = [{}]\n{input}{scenario}", names(last));
        let before = found(&source, &logs, false);
        let (text, unwritten) =
            study::write_values(&source, &before).unwrap_or_else(|reported| panic!("{}", plain(&source, &reported)));
        assert!(unwritten.iter().all(|note| last == drift && note.starts_with(drift)), "{unwritten:?}");
        assert!(text.contains(&format!("]\n{expected}{scenario}")), "{input}: {text}");
        let laws = if last == drift { 1 } else { 2 };
        assert_eq!(text.matches("[torque.").count(), laws, "{text}");
        found(&text, &logs, false);
    }
}

/// `--write` refuses values with which the file would have a mistake, and says which; what a key cannot hold is left out, with the reason.
#[test]
fn a_file_that_would_be_wrong_is_not_written() {
    let logs = [log(44, plain_torque)];
    let names = "[identification]\nparameters = [\"s.inertia\", \"s.damping\", \"s.friction\"]\n";
    // It breaks away at less than it slides with.
    let friction = "friction = \"0.1 N m\"\nbreakaway = \"0.2 N m\"\nstribeck_speed = \"10 mrad/s\"";
    let source = format!("{}{names}", SHAFT.replace("friction = \"0.3 N m\"", friction));
    let before = found(&source, &logs, false);
    near(&before, "s.friction", 0.3);
    let reported = study::write_values(&source, &before).expect_err("more than it breaks away at");
    let text = plain(&source, &reported);
    assert!(
        text.contains("the identified values would make the file invalid: ") && text.contains("breakaway"),
        "{text}"
    );
    assert!(reported.iter().all(|one| one.labels.is_empty() && one.help.is_some()), "{reported:?}");
    let source = format!("{SHAFT}{names}");
    let before = found(&source, &[log(45, |at| 0.02 * at.speed - 0.05 * at.speed.signum())], false);
    near(&before, "s.friction", -0.05);
    let (text, unwritten) =
        study::write_values(&source, &before).unwrap_or_else(|reported| panic!("{}", plain(&source, &reported)));
    assert_eq!(unwritten, ["s.friction: the identified value is below zero, which the file cannot represent"]);
    assert!(text.contains("friction = \"0.3 N m\""), "{text}");
    // Mistakes that were there before are told at their places.
    let wrong = format!("{source}[motor.other]\nshaft = \"t\"\n");
    let reported = study::write_values(&wrong, &before).expect_err("there is no such shaft");
    assert!(reported.iter().all(|one| one.message.contains("`t`") && !one.labels.is_empty()), "{reported:?}");
}

/// What `--suggest` takes, `--write` puts into the file: a file that is read again predicts the same.
#[test]
fn suggested_terms_are_written() {
    type RawValue<'a> = (&'a str, &'a dyn Fn(&At) -> f64, &'a str);
    let cases: [RawValue<'_>; 2] = [
        ("s.quadratic_damping", &|at| 0.0005 * at.speed * at.speed.abs(), "[torque.s_quadratic_damping_law]"),
        ("s.friction_ripple_1", &|at| 0.02 * (at.angle + 0.7).sin() * at.speed.signum(), "kind = \"ripple\""),
    ];
    for (name, torque, write_values) in cases {
        let logs = [log(51, |at| plain_torque(at) + torque(at))];
        let (found, suggestions) = suggested(SHAFT, &logs);
        assert_eq!(suggestions.selected_terms, [name], "{suggestions:?}");
        let (text, _) = study::write_values(SHAFT, &found).unwrap();
        assert!(text.contains(write_values), "{text}");
        let again = self::found(&text, &logs, false);
        for parameter in ["s.damping", "s.friction"] {
            let [one, other] = [&suggestions.parameters, &again.parameters].map(|all| one(all, parameter));
            let (value, error) = (one.value.unwrap(), one.standard_error.unwrap());
            assert!(
                (other.value.unwrap() - value).abs() < 0.3 * error,
                "{parameter}: {other:?} instead of {value} ± {error}"
            );
        }
        let cross_validated = [&suggestions.validation, &again.validation].map(|all| all[0].cross_validated.unwrap());
        assert!((cross_validated[0] / cross_validated[1] - 1.0).abs() < 0.02, "{cross_validated:?}");
    }
}

/// A backlash of a spring, and teeth that rub, are among what is tried, and taken where they are there.
#[test]
fn plays_and_losses_are_suggested() {
    let (stiffness, half) = (100.0, 0.002_f64);
    let spring = |twist: f64, _| if twist.abs() > half { stiffness * (twist - half.copysign(twist)) } else { 0.0 };
    let (_, suggestions) = suggested(SPRING, &[spring_log(spring)]);
    assert_eq!(suggestions.selected_terms.first().map(String::as_str), Some("k.backlash_torque"), "{suggestions:?}");
    let [width, error] = {
        let one = one(&suggestions.parameters, "k.backlash");
        [one.value.unwrap(), one.standard_error.unwrap()]
    };
    assert!(((width - 2.0 * half) / error).abs() < 4.0, "{width} ± {error}");
}
