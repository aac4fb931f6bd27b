//! Torques of expressions, teeth that rub and plays, found back in logs that runs of the same models made; and what `--write` makes of terms.

use kardan::diagnostics::plain;
use kardan::num::Random;
use kardan::results::{Identification, IdentifiedParameter, Outcome};
use kardan::study::{self, IdentifySettings, LogFile, Silent, identify};
use kardan::tables::read::in_memory;

use crate::common::runs_only;

/// The run of a model as a log.
fn log(source: &str) -> String {
    let study =
        crate::common::project(source).run(&runs_only(), &Silent).unwrap_or_else(|reported| panic!("{reported:?}"));
    assert_eq!(study.runs[0].outcome, Outcome::Completed, "{source}");
    String::from_utf8(kardan::export::csv(&study.runs[0])).unwrap()
}

fn tried(source: &str, log: &str, settings: IdentifySettings) -> Result<Identification, String> {
    let files = vec![LogFile { name: "log.csv".into(), bytes: in_memory(log.as_bytes().to_vec()) }];
    identify(source, files, &settings, &Silent).map_err(|wrong| plain(source, &wrong))
}

fn found(source: &str, log: &str, parameters: &[&str]) -> Identification {
    let parameters = parameters.iter().map(ToString::to_string).collect();
    let settings = IdentifySettings { parameters, method: Some("dynamic".into()), ..IdentifySettings::default() };
    tried(source, log, settings).unwrap_or_else(|wrong| panic!("{wrong}"))
}

fn one<'a>(all: &'a [IdentifiedParameter], name: &str) -> &'a IdentifiedParameter {
    all.iter().find(|one| one.name == name).unwrap_or_else(|| panic!("no {name} in {all:?}"))
}

/// Runs have no noise: what is left is the filter's, of second order in its width.
fn near(found: &Identification, name: &str, truth: f64, part: f64) {
    let value = one(&found.parameters, name).value.unwrap();
    assert!((value / truth - 1.0).abs() < part, "{name}: {value} instead of {truth}");
}

/// An arm with gravity, driven so that it swings and turns over.
fn pendulum(ml: &str, more: &str) -> String {
    format!(
        "[parameters]\nml = \"{ml}\"\n[shaft.arm]\ninertia = \"0.2 kg m^2\"\ndamping = \"0.3 N m s/rad\"\n[motor.m]\nshaft = \"arm\"\n\
         [torque.gravity]\nshaft = \"arm\"\nlaw = \"-ml * 9.81 m/s^2 * sin(arm.phi)\"\n{more}\
         [scenario]\nduration = \"20 s\"\noutput_step = \"1 ms\"\n\
         signals = {{ \"m.tau\" = \"4 N m * sin(2 * t / 1 s) + 3 N m * sin(0.7 * t / 1 s)\" }}\n"
    )
}

#[test]
fn mass_times_length_of_an_arm_with_gravity() {
    let log = log(&pendulum("0.6 kg m", ""));
    // The file knows it badly; what it says does not matter, as the law is linear in it.
    for guess in ["0.1 kg m", "0 kg m"] {
        let found = found(&pendulum(guess, ""), &log, &["arm.inertia", "arm.damping", "ml"]);
        near(&found, "ml", 0.6, 1e-3);
        near(&found, "arm.inertia", 0.2, 2e-3);
        near(&found, "arm.damping", 0.3, 2e-3);
        assert_eq!(one(&found.parameters, "ml").unit, "kg m");
        assert!(one(&found.parameters, "ml").interval.is_some());
    }
    // A law that is not asked for is known.
    let found = found(&pendulum("0.6 kg m", ""), &log, &["arm.inertia", "arm.damping"]);
    near(&found, "arm.inertia", 0.2, 2e-3);
    near(&found, "arm.damping", 0.3, 2e-3);
}

/// Drag with the square of the speed, beside a law of the time, a signal and a table that are known.
#[test]
fn the_drag_of_a_fan() {
    let fan = |k: &str| {
        format!(
            "[parameters]\nk = \"{k}\"\n[shaft.s]\ninertia = \"0.01 kg m^2\"\n[motor.m]\nshaft = \"s\"\n[signal.wind]\nkind = \"sine\"\n\
             amplitude = \"0.4 N m\"\nfrequency = \"0.3 Hz\"\n[table.hump]\npoints = {{ x = [\"-50 rad/s\", \"50 rad/s\"], value = [\"-0.2 N m\", \"0.2 N m\"] }}\n\
             [torque.drag]\nshaft = \"s\"\nlaw = \"-k * s.w * abs(s.w) + wind - hump(s.w) + 0.3 N m * sin(3 * t / 1 s)\"\n\
             [scenario]\nduration = \"20 s\"\noutput_step = \"1 ms\"\nsignals = {{ \"m.tau\" = \"1.5 N m * sin(0.9 * t / 1 s) + 0.6 N m * sin(2.3 * t / 1 s)\" }}\n"
        )
    };
    let log = log(&fan("4e-3 N m s^2/rad^2"));
    let found = found(&fan("1e-3 N m s^2/rad^2"), &log, &["k", "s.inertia"]);
    near(&found, "k", 4e-3, 1e-3);
    near(&found, "s.inertia", 0.01, 1e-3);
    assert_eq!(one(&found.parameters, "k").unit, "kg m^2/rad^2");
}

/// What is not linear, or stands elsewhere too, is refused by name with what to do.
#[test]
fn what_is_not_linear_is_refused() {
    let log = log(&pendulum("0.6 kg m", ""));
    let refused = |source: &str, name: &str| {
        let settings =
            IdentifySettings { parameters: vec![name.into(), "arm.damping".into()], ..IdentifySettings::default() };
        tried(source, &log, settings).unwrap_err()
    };
    let more = |law: &str| {
        pendulum("0.6 kg m", &format!("[torque.more]\nshaft = \"arm\"\nlaw = \"{law}\"\n"))
            .replace("[parameters]\n", "[parameters]\nshift = \"0.1 rad\"\nlimit = \"1 rad/s\"\npull = \"0.5 N m\"\n")
    };
    let reported = refused(&more("pull * sin(arm.phi + shift)"), "shift");
    assert!(reported.contains("`more` is not linear in `shift`") && reported.contains("its own factor"), "{reported}");
    let reported = refused(&more("if(arm.w > limit, pull, 0 N m)"), "limit");
    assert!(reported.contains("not linear in `limit`: the place of its kink or jump"), "{reported}");
    let reported = refused(
        &more("-pull * arm.w / limit").replace("damping = \"0.3", "friction = \"pull\"\ndamping = \"0.3"),
        "pull",
    );
    assert!(reported.contains("`pull` occurs in the law of `more` and also in `arm.friction`"), "{reported}");
    // Linear together with others: `pull` alone is.
    let fine = found(&more("pull * sin(arm.phi + shift)"), &log, &["pull", "ml"]);
    assert!(one(&fine.parameters, "pull").value.unwrap().abs() < 5e-3, "{:?}", fine.parameters);
}

/// A motor, a gear 5:1 that rubs, and a load; power goes both ways.
fn lossy(gear_loss: &str, more: &str) -> String {
    format!(
        "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n\
         [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 5\n{gear_loss}[motor.m]\nshaft = \"a\"\n{more}\
         [scenario]\nduration = \"20 s\"\noutput_step = \"1 ms\"\n\
         signals = {{ \"m.tau\" = \"2 N m * sin(1.3 * t / 1 s) + 1 N m * sin(3.1 * t / 1 s)\" }}\n"
    )
}

#[test]
fn gear_losses_are_identified() {
    let log = log(&lossy("efficiency = 0.8\nefficiency_back = 0.7\n", ""));
    let extra = "[[identification.extra]]\nkind = \"gear_loss\"\ngear = \"g\"\n";
    // Cut where nothing is sought: on the side of the motor, or of the load.
    for (sought, truth) in [("b.damping", 0.5), ("a.inertia", 0.01)] {
        let found = found(&lossy("", extra), &log, &[sought, "g.tooth_loss"]);
        near(&found, sought, truth, 5e-3);
        near(&found, "g.efficiency", 0.8, 5e-3);
        near(&found, "g.efficiency_back", 0.7, 1e-2);
        let [loss, back] =
            ["g.tooth_loss", "g.tooth_loss_back"].map(|name| one(&found.parameters, name).value.unwrap());
        // Of the torque of the motor 1 − η, of that of the load the inverse less one.
        let expected = if sought == "b.damping" { [0.2, 3.0 / 7.0] } else { [0.25, 0.3] };
        assert!((loss - expected[0]).abs() < 5e-3 && (back - expected[1]).abs() < 1e-2, "{loss} {back} {expected:?}");
        assert!(found.notes.iter().all(|note| !note.contains("first order")), "{:?}", found.notes);
    }
    // What the file says is known.
    let explicit_loss = lossy("efficiency = 0.8\nefficiency_back = 0.7\n", "");
    let found = self::found(&explicit_loss, &log, &["b.damping", "a.inertia"]);
    near(&found, "b.damping", 0.5, 1e-2);
    near(&found, "a.inertia", 0.01, 1e-1);
    assert!(found.notes.iter().any(|note| note.contains("first order")), "{:?}", found.notes);
}

#[test]
fn a_loss_that_would_explain_itself_is_refused() {
    let log = log(&lossy("efficiency = 0.8\n", ""));
    let extra = "[[identification.extra]]\nkind = \"gear_loss\"\ngear = \"g\"\n";
    let parameters = ["b.damping", "b.inertia", "g.tooth_loss"].map(String::from).to_vec();
    let settings = IdentifySettings { parameters, ..IdentifySettings::default() };
    let reported = tried(&lossy("", extra), &log, settings).unwrap_err();
    assert!(
        reported.contains("the gear loss of `g` is unidentifiable") && reported.contains("g.tooth_loss"),
        "{reported}"
    );
}

/// Teeth with play between two shafts whose angles are measured.
#[test]
fn the_width_of_a_backlash() {
    let model = |backlash: &str, offset: &str| {
        format!(
            "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.1 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n\
             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\nbacklash = \"{backlash}\"\noffset = \"{offset}\"\n[motor.m]\nshaft = \"a\"\n\
             [scenario]\nduration = \"10 s\"\noutput_step = \"1 ms\"\nsignals = {{ \"m.tau\" = \"2 N m * sin(3 * t / 1 s)\" }}\n"
        )
    };
    let log = log(&model("20 mrad", "5 mrad"));
    let found = found(&model("1 mrad", "0 mrad"), &log, &["b.damping", "g.backlash"]);
    near(&found, "g.backlash", 0.02, 1e-3);
    near(&found, "g.offset", 0.005, 1e-3);
    near(&found, "b.damping", 0.5, 2e-2);
    assert_eq!(one(&found.parameters, "g.backlash").model_value, Some(0.001));
    assert_eq!(found.eliminated, ["g"]);
    let (text, unwritten) = study::write_values(&model("1 mrad", "0 mrad"), &found).unwrap();
    assert!(unwritten.is_empty() && text.contains("backlash = \"0.0"), "{unwritten:?}\n{text}");
}

/// Which way the teeth are pressed follows from what was found, not from what the file says of it.
#[test]
fn the_width_of_a_backlash_with_other_parameters() {
    let model = |damping: &str, friction: &str| {
        let turns: String = [-0.3, 0.4, -0.5, 0.6, -0.7, 0.3, -0.4, 0.5]
            .iter()
            .enumerate()
            .map(|(k, torque)| {
                format!("[[scenario.event]]\nat = \"{k}.2 s\"\nsignal = \"m.tau\"\nto = \"{torque} N m\"\nover = \"0.5 s\"\n")
            })
            .collect();
        format!(
            "[shaft.a]\ninertia = \"1e-3 kg m^2\"\ndamping = \"1e-3 N m s/rad\"\nfriction = \"0.01 N m\"\n\
             [shaft.b]\ninertia = \"1e-2 kg m^2\"\ndamping = \"{damping} N m s/rad\"\nfriction = \"{friction} N m\"\n\
             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = -5\nbacklash = \"10 deg\"\noffset = \"3 deg\"\n\
             [motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"8 s\"\noutput_step = \"1 ms\"\n{turns}"
        )
    };
    let log = log(&model("0.05", "0.02"));
    let (width, offset) = (10.0_f64.to_radians(), 3.0_f64.to_radians());
    let width_of = |damping: &str, friction: &str, sought: &[&str]| {
        let found = found(&model(damping, friction), &log, &[sought, &["g.backlash"]].concat());
        let [width_found, offset_found] =
            ["g.backlash", "g.offset"].map(|name| one(&found.parameters, name).value.unwrap());
        assert!((width_found - width).abs() < 1e-3, "{damping} {friction}: {width_found} instead of {width}");
        assert!((offset_found - offset).abs() < 1e-3, "{damping} {friction}: {offset_found} instead of {offset}");
        width_found
    };
    // What the file says of what is sought does not matter at all.
    let reference = width_of("0.05", "0.02", &["a.damping", "b.damping"]);
    for wrong in ["0.005", "0.5", "0"] {
        let other = width_of(wrong, "0.02", &["a.damping", "b.damping"]);
        assert!((other - reference).abs() < 1e-9, "{wrong}: {other} instead of {reference}");
    }
    width_of("0.005", "0.2", &["a.damping", "b.damping", "b.friction"]);
}

/// Teeth that rub are suggested where the load is known, and `--write` makes efficiencies of them, with which the file predicts the same.
#[test]
fn gear_losses_are_suggested() {
    let log = log(&lossy("efficiency = 0.8\nefficiency_back = 0.7\n", ""));
    let settings = IdentifySettings {
        parameters: vec!["a.inertia".into()],
        method: Some("dynamic".into()),
        suggest: true,
        ..IdentifySettings::default()
    };
    let source = lossy("", "");
    let found = tried(&source, &log, settings).unwrap();
    let suggestions = found.suggestions.as_ref().unwrap();
    assert_eq!(suggestions.selected_terms.first().map(String::as_str), Some("g.tooth_loss"), "{suggestions:?}");
    let (text, _) = study::write_values(&source, &found).unwrap();
    assert!(text.contains("efficiency = \"0.") && text.contains("efficiency_back = \"0."), "{text}");
    let again = self::found(&text, &log, &["a.inertia"]);
    near(&again, "a.inertia", 0.01, 5e-3);
    let cross_validated =
        [&suggestions.validation, &again.validation].map(|all| all[0].cross_validated.unwrap() / all[0].torque);
    assert!(cross_validated.iter().all(|part| *part < 0.02), "{cross_validated:?}");
}

/// A log with noise on some of its columns.
fn noisy(log: &str, columns: &[&str], size: f64, seed: u64) -> String {
    let mut random = Random::new(seed);
    let mut lines = log.lines();
    let header = lines.next().expect("a header");
    let own: Vec<bool> = header.split(',').map(|name| columns.contains(&name)).collect();
    let mut out = format!("{header}\n");
    for line in lines {
        let values = line.split(',').zip(&own).map(|(text, noisy)| match (noisy, text.parse::<f64>()) {
            (true, Ok(value)) => format!("{:?}", value + size * random.normal()),
            _ => text.to_string(),
        });
        out += &(values.collect::<Vec<_>>().join(",") + "\n");
    }
    out
}

/// A gear with play between a motor and a load; the time that it runs, and what drives it.
fn with_backlash(backlash: &str, more: &str, [duration, torque]: [&str; 2]) -> String {
    format!(
        "[shaft.a]\ninertia = \"0.01 kg m^2\"\n[shaft.b]\ninertia = \"0.1 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n\
         [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = 3\nbacklash = \"{backlash}\"\n[motor.m]\nshaft = \"a\"\n{more}\
         [scenario]\nduration = \"{duration}\"\noutput_step = \"1 ms\"\nsignals = {{ \"m.tau\" = \"{torque}\" }}\n"
    )
}

const TURNS: [&str; 2] = ["10 s", "2 N m * sin(3 * t / 1 s)"];

/// Over fifty logs with noise the interval of 95 % has the true width about 95 % of the time, and the standard errors are as large as the
/// errors: of 50 intervals 44 to 50 do so with a probability of 99 %; a standard deviation from 50 errors is within 30 % with one of 99.7 %.
#[test]
fn the_interval_of_a_width_covers_it() {
    let clean = log(&with_backlash("20 mrad", "", TURNS));
    let model = with_backlash("1 mrad", "", TURNS);
    let (mut covered, mut errors, mut reported) = ([0, 0], 0.0, 0.0);
    for seed in 0..50 {
        let found = found(&model, &noisy(&clean, &["a.phi", "b.phi"], 2e-4, seed), &["b.damping", "g.backlash"]);
        for (count, (name, truth)) in covered.iter_mut().zip([("g.backlash", 0.02), ("g.offset", 0.0)]) {
            let interval = one(&found.parameters, name).interval.expect("an interval");
            *count += usize::from(interval.lower <= truth && truth <= interval.upper);
        }
        let width = one(&found.parameters, "g.backlash");
        errors += (width.value.unwrap() - 0.02).powi(2) / 50.0;
        reported += width.standard_error.unwrap().powi(2) / 50.0;
    }
    assert!(covered.iter().all(|count| *count >= 44), "{covered:?} of 50");
    let ratio = (reported / errors).sqrt();
    assert!((0.7..1.3).contains(&ratio), "standard errors are {ratio} of the errors");
}

/// Without noise steps of a sensor and digits of the log are what is left: `Δ/√12` in each contact, of which there are four to six on either
/// side.
#[test]
fn steps_of_a_sensor_bound_the_error_of_a_width() {
    let clean = log(&with_backlash("20 mrad", "", TURNS));
    let sensor = "[sensor.e]\nmeasures = \"angle\"\nshaft = \"a\"\nresolution = \"2 mrad\"\n";
    let error = |more: &str| {
        let found = found(&with_backlash("1 mrad", more, TURNS), &clean, &["b.damping", "g.backlash"]);
        near(&found, "g.backlash", 0.02, 1e-3);
        one(&found.parameters, "g.backlash").standard_error.unwrap()
    };
    let step = 2e-3 / 12.0_f64.sqrt();
    let coarse = error(sensor);
    assert!((step * (2.0_f64 / 6.0).sqrt()..=step * (2.0_f64 / 4.0).sqrt()).contains(&coarse), "{coarse}");
    // Angles of some ten radians are written with sixteen digits, of which seven are trusted.
    let fine = error("");
    assert!((1e-7..1e-5).contains(&fine), "{fine}");
}

/// A width is not told where the teeth are pressed on one side alone, nor where which way they are pressed hangs on what these data do not
/// tell; where they are pressed once on each side there is a value without an interval, and nothing goes into the file.
#[test]
fn a_width_that_is_not_determined() {
    let reported = |model: &str, log: &str, parameters: &[&str]| {
        let found = found(model, log, parameters);
        let width = one(&found.parameters, "g.backlash").clone();
        assert!(width.interval.is_none(), "{width:?}");
        assert!(found.for_file.values.iter().all(|one| one.name != "g.backlash"), "{:?}", found.for_file.values);
        assert!(
            found.for_file.omissions.iter().any(|one| one.starts_with("g.backlash: ")),
            "{:?}",
            found.for_file.omissions
        );
        width
    };
    let one_way = with_backlash("20 mrad", "", ["4 s", "1 N m + 0.2 N m * sin(9 * t / 1 s)"]);
    let width = reported(&one_way, &log(&one_way), &["b.damping", "g.backlash"]);
    assert_eq!(width.remark, "in these logs it rarely has contact on both sides");
    assert!(width.value.is_none() && width.standard_error == Some(f64::INFINITY), "{width:?}");
    // Once to and fro.
    let once = with_backlash("20 mrad", "", ["2 s", "2 N m * sin(pi * t / 1 s)"]);
    let width = reported(&once, &log(&once), &["b.damping", "g.backlash"]);
    assert!(width.remark.starts_with("no interval: it has one contact on each side"), "{}", width.remark);
    assert!((width.value.unwrap() - 0.02).abs() < 1e-4 && width.standard_error.is_none(), "{width:?}");
    // Friction in Stribeck's curve on either side: how large it is at a speed the fit alone knows.
    let rubs = |shaft: &str| format!("[[identification.extra]]\nkind = \"stribeck\"\nfriction = \"{shaft}\"\n");
    let model = with_backlash("20 mrad", &(rubs("a") + &rubs("b")), TURNS)
        .replace("inertia", "friction = \"0.01 N m\"\ninertia");
    let width = reported(&model, &log(&model), &["b.damping", "a.stribeck", "b.stribeck", "g.backlash"]);
    let start = "its contact side depends on `";
    assert!(width.remark.starts_with(start) && width.remark.contains(".stribeck`, which"), "{}", width.remark);
}
