//! `kardan identify` as its users meet it: text, JSON, page, a model file with what was found, and what it says when it cannot be done.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use super::schemas::printed;

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Miette's frame and line breaks taken out.
fn plain_text(bytes: &[u8]) -> String {
    text(bytes).replace(['│', '×', '╰', '─', '▶'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

const MODEL: &str = "[model]\nname = \"axle\"\n[shaft.axle]\ninertia = \"0.01 kg m^2\" # from the drawing\n\
                     damping = \"0.1 N m s/rad\"\nfriction = \"0.1 N m\"\n[motor.drive]\nshaft = \"axle\"\n";

/// A fresh folder of the test's own, with a model of an axle and a log of it: 0.02 N m s/rad, 0.3 N m, and what a clock knows as noise.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("identify").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    let mut log = String::from("time,axle.w,drive.tau\ns,rad/s,N m\n");
    for k in 0..8000 {
        let t = 0.001 * f64::from(k);
        let speed = [5.0, 12.0, -4.0, -15.0, 20.0, -9.0, 7.0, -20.0][k as usize / 1000];
        let hiss = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
        let _ = writeln!(log, "{t:.3},{speed},{:.6}", 0.02 * speed + 0.3_f64.copysign(speed) + 0.05 * hiss);
    }
    fs::write(path.join("axle.toml"), MODEL).unwrap();
    fs::write(path.join("bench.csv"), log).unwrap();
    path
}

#[test]
fn text_json_page_and_file() {
    let at = folder("all");
    let line = ["identify", "axle.toml", "bench.csv", "--report", "fit.html", "--write", "new.toml", "--compare"];
    let got = kardan(&at, &line);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let stdout = plain_text(&got.stdout);
    for part in [
        "All 2 parameters are determined",
        "8 segments of constant speed",
        "95 % interval",
        "Passive as a whole",
        "Models compared",
        "bench.csv: 8000 rows",
    ] {
        assert!(stdout.contains(part), "{part}: {stdout}");
    }
    assert!(plain_text(&got.stderr).contains("wrote fit.html"), "{}", plain_text(&got.stderr));
    let page = fs::read_to_string(at.join("fit.html")).unwrap();
    for part in ["<!doctype html>", "axle.friction", "Friction over speed", "Models compared", "Correlations"] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN") && !page.contains("http://") && !page.contains("https://"));
    // The file is the old one with new values, and every other command takes it.
    let new = fs::read_to_string(at.join("new.toml")).unwrap();
    assert!(new.contains("inertia = \"0.01 kg m^2\" # from the drawing") && new.contains("95 %"), "{new}");
    let analyzed = kardan(&at, &["analyze", "new.toml"]);
    assert_eq!(analyzed.status.code(), Some(0), "{}", plain_text(&analyzed.stderr));
    assert!(plain_text(&analyzed.stdout).contains("axle.damping"), "the intervals are tolerances there");

    let got = kardan(&at, &["identify", "axle.toml", "bench.csv", "--json", "--confidence", "99%", "-q"]);
    let object = printed(&got.stdout);
    assert_eq!((&object["method"], &object["confidence"]), (&Value::from("steady"), &Value::from(0.99)));
    for (number, name, truth) in [(0, "axle.damping", 0.02), (1, "axle.friction", 0.3)] {
        let one = &object["parameters"][number];
        assert_eq!(one["name"], name);
        let (value, error) = (one["value"].as_f64().unwrap(), one["standard_error"].as_f64().unwrap());
        assert!((value - truth).abs() < 5.0 * error && error < 0.02 * truth, "{one}");
        let [low, high] = [0, 1].map(|end| one["interval"][end].as_f64().unwrap());
        assert!(low < value && value < high && (high - low) / 2.0 > 2.5 * error, "99 %: {one}");
    }
    assert_eq!(got.stderr, b"");
    // A time may be a number of seconds, names may stand apart.
    let line = [
        "identify",
        "axle.toml",
        "bench.csv",
        "--json",
        "-q",
        "--window",
        "0.04",
        "--parameters",
        "axle.damping, axle.friction",
    ];
    let object = printed(&kardan(&at, &line).stdout);
    assert_eq!((object["window_s"].as_f64(), object["parameters"].as_array().unwrap().len()), (Some(0.04), 2));
}

/// What Stribeck friction was found goes into the file as the torque at which it breaks away.
#[test]
fn a_breakaway_torque_is_written() {
    let at = folder("breakaway");
    let mut log = String::from("time,axle.w,drive.tau\ns,rad/s,N m\n");
    for k in 0..40_000 {
        let t = 0.001 * f64::from(k);
        let speed = 12.0 * (0.5 * t).sin().powi(3) + 0.3 * (2.3 * t).sin();
        let rate = 18.0 * (0.5 * t).sin().powi(2) * (0.5 * t).cos() + 0.69 * (2.3 * t).cos();
        let friction = 0.3 + 0.2 * (-(speed / 1.5_f64).powi(2)).exp();
        let hiss = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
        let torque = 0.01 * rate + 0.02 * speed + friction.copysign(speed) + 0.02 * hiss;
        let _ = writeln!(log, "{t:.3},{speed:.9},{torque:.9}");
    }
    fs::write(at.join("slow.csv"), log).unwrap();
    let extra = "[[identification.extra]]\nkind = \"stribeck\"\nfriction = \"axle\"\n";
    fs::write(at.join("sticky.toml"), format!("{MODEL}{extra}")).unwrap();
    let got = kardan(&at, &["identify", "sticky.toml", "slow.csv", "--write", "new.toml"]);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let new = fs::read_to_string(at.join("new.toml")).unwrap();
    assert!(new.contains("breakaway = ") && new.contains("stribeck_speed = "), "{new}");
    let got = kardan(&at, &["check", "new.toml"]);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
}

/// A term that is missing is told with what to write, and the file with it has it.
#[test]
fn a_missing_term_is_suggested() {
    let at = folder("suggest");
    let mut log = String::from("time,axle.w,drive.tau\ns,rad/s,N m\n");
    for k in 0..30_000 {
        let t = 0.001 * f64::from(k);
        let (speed, rate) =
            (12.0 * (0.8 * t).sin() + 2.0 * (2.3 * t).sin(), 9.6 * (0.8 * t).cos() + 4.6 * (2.3 * t).cos());
        let hiss = f64::from(k * 7919 % 1009) / 1009.0 - 0.5;
        let torque = 0.01 * rate + 0.02 * speed + 0.3_f64.copysign(speed) + 0.05 + 0.05 * hiss;
        let _ = writeln!(log, "{t:.3},{speed:.9},{torque:.9}");
    }
    fs::write(at.join("both.csv"), log).unwrap();
    let line = ["identify", "axle.toml", "both.csv", "--method", "dynamic", "--suggest"];
    let got = kardan(&at, &[&line[..], &["--json", "-q", "--report", "fit.html"]].concat());
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let object = printed(&got.stdout);
    let suggestions = &object["suggestions"];
    assert_eq!(suggestions["selected_terms"], serde_json::json!(["axle.friction_asymmetry"]), "{suggestions}");
    let page = fs::read_to_string(at.join("fit.html")).unwrap();
    assert!(page.contains("Terms suggested") && !page.contains("NaN"));
    let stdout = plain_text(&kardan(&at, &line).stdout);
    for part in [
        "With axle.friction_asymmetry, the fit on left-out segments",
        "take it",
        "kind = \"friction_asymmetry\"",
        "the logs do not distinguish the two",
    ] {
        assert!(stdout.contains(part), "{part}: {stdout}");
    }
    fs::write(at.join("more.toml"), format!("{MODEL}{}", suggestions["text"].as_str().unwrap())).unwrap();
    let object =
        printed(&kardan(&at, &["identify", "more.toml", "both.csv", "--method", "dynamic", "--json", "-q"]).stdout);
    assert_eq!(object["parameters"], suggestions["parameters"]);
    // Who does not ask gets none.
    let object = printed(&kardan(&at, &["identify", "axle.toml", "both.csv", "--json", "-q"]).stdout);
    assert!(object["suggestions"].is_null(), "{object}");
}

#[test]
fn what_cannot_be_is_reported() {
    let at = folder("wrong");
    fs::write(at.join("empty.csv"), "").unwrap();
    fs::write(at.join("page.csv"), "<!DOCTYPE html><html><body>Not found</body></html>").unwrap();
    fs::create_dir(at.join("logs")).unwrap();
    for (line, parts) in [
        (vec!["identify", "axle.toml", "bnch.csv"], vec!["bnch.csv", "did you mean", "bench.csv"]),
        (vec!["identify", "axle.toml", "logs"], vec!["directory"]),
        (vec!["identify", "axle.toml", "empty.csv"], vec!["empty.csv", "empty"]),
        (vec!["identify", "axle.toml", "page.csv"], vec!["page.csv"]),
        (vec!["identify", "axle.toml", "axle.toml"], vec!["axle.toml"]),
        (vec!["identify", "axle.toml"], vec!["LOG"]),
        (vec!["identify", "axle.toml", "bench.csv", "--window", "long"], vec!["not a time above zero", "50 ms"]),
        (vec!["identify", "axle.toml", "bench.csv", "./bench.csv"], vec!["is repeated"]),
        (vec!["identify", "axle.toml", "bench.csv", "--confidence", "0.95"], vec!["did you mean 95?"]),
        (vec!["identify", "axle.toml", "bench.csv", "--parameters", "axle.damping,,"], vec!["no name"]),
        (vec!["identify", "axle.toml", "bench.csv", "--confidence", "100"], vec!["95"]),
        (vec!["identify", "axle.toml", "bench.csv", "--parameters", "axle.damping,axle.x"], vec!["axle.x"]),
        (vec!["identify", "axle.toml", "bench.csv", "--parameters", "axle.inertia"], vec!["constant speed"]),
        (vec!["identify", "axle.toml", "bench.csv", "--write", "logs"], vec!["not the name of a file"]),
    ] {
        // At constant speeds an inertia cannot be told.
        let line = if line.contains(&"axle.inertia") { [&line[..], &["--method", "steady"]].concat() } else { line };
        let got = kardan(&at, &line);
        assert_eq!(got.status.code(), Some(2), "{line:?}");
        assert_eq!(got.stdout, b"", "{line:?}");
        let stderr = plain_text(&got.stderr);
        parts.iter().for_each(|part| assert!(stderr.contains(part), "{line:?}: {part}: {stderr}"));
    }
    let got = kardan(&at, &["identify", "axle.toml", "empty.csv", "--json"]);
    let object = printed(&got.stdout);
    assert!(object["error"]["message"].as_str().is_some_and(|why| why.contains("empty")), "{object}");
    // A log that breaks off in a row: the rows before it count.
    let log = fs::read_to_string(at.join("bench.csv")).unwrap();
    fs::write(at.join("broken.csv"), &log[..log.len() - 9]).unwrap();
    let got = kardan(&at, &["identify", "axle.toml", "broken.csv"]);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    assert!(plain_text(&got.stdout).contains("may be cut"), "{}", plain_text(&got.stdout));
}

/// A log that is cut stands in the first sentence of text, page and JSON, and `--strict` gives its exit code.
#[test]
fn damage_is_reported_in_the_headline() {
    let at = folder("damage");
    let line = ["identify", "axle.toml", "bench.csv", "--strict"];
    let sound = kardan(&at, &["identify", "axle.toml", "bench.csv", "--strict", "--json", "-q"]);
    assert_eq!(sound.status.code(), Some(0), "{}", plain_text(&sound.stderr));
    let object = printed(&sound.stdout);
    assert_eq!((&object["reliable"], &object["logs"][0]["damage"]), (&Value::from(true), &Value::Null));
    let log = fs::read(at.join("bench.csv")).unwrap();
    fs::write(at.join("bench.csv"), &log[..log.len() - 7]).unwrap();
    let got = kardan(&at, &line);
    assert_eq!(got.status.code(), Some(1), "{}", plain_text(&got.stderr));
    let headline = "All 2 parameters are determined, from a log that is damaged (bench.csv: ";
    let stdout = plain_text(&got.stdout);
    assert!(stdout.contains(headline), "{stdout}");
    let line = ["identify", "axle.toml", "bench.csv", "--json", "-q", "--report", "fit.html"];
    let got = kardan(&at, &line);
    assert_eq!(got.status.code(), Some(0), "without --strict: {}", plain_text(&got.stderr));
    let object = printed(&got.stdout);
    assert!(object["verdict"].as_str().unwrap().contains(headline) && object["reliable"] == false, "{object}");
    assert!(fs::read_to_string(at.join("fit.html")).unwrap().contains(headline));
}
