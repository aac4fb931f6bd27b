//! `kardan bench`: files, exit codes, JSON, and a file of true values that stays out of the model.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use super::schemas::printed;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("bench_{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn bench(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).arg("bench").args(arguments).stdin(Stdio::null()).output().unwrap()
}

/// The built-in bench with few points, without its true values.
fn model(folder: &Path) -> String {
    let text = kardan::model::builtin("harmonic-drive-bench").unwrap().source;
    let (before, after) = (text.rfind("[bench.truth]").unwrap(), text.find("[scenario]").unwrap());
    let text = format!("{}{}", &text[..before], &text[after..]).replace("points = 24", "points = 6");
    let text = text.replace("dwell = \"2 s\"", "dwell = \"0.2 s\"");
    fs::write(folder.join("m.toml"), &text).unwrap();
    text
}

#[test]
fn logs_are_written_and_come_back() {
    let at = folder("logs");
    model(&at);
    fs::write(at.join("hidden.toml"), "[bench.truth]\n\"wg.damping\" = \"0.001 N m s/rad\"\n").unwrap();
    let arguments =
        ["m.toml", "--truth", "hidden.toml", "--repetitions", "2", "--format", "csv,parquet", "--seed", "5"];
    let got = bench(&at, &[&arguments[..], &["--json", "--out", "a"]].concat());
    assert_eq!(got.status.code(), Some(0), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!(object["logs"].as_array().unwrap().len(), 2);
    assert_eq!(object["logs"][1]["files"].as_array().unwrap().len(), 2);
    assert_eq!(object["truth"][0]["name"], "wg.damping");
    assert_eq!(object["truth"][0]["value"], 0.001);
    assert_eq!(object["plan"]["points"].as_array().unwrap().len(), 6);
    for file in object["logs"].as_array().unwrap().iter().flat_map(|log| log["files"].as_array().unwrap()) {
        assert!(at.join(file.as_str().unwrap()).exists(), "{file}");
    }
    let log = fs::read_to_string(at.join("a/harmonic-drive-bench-5.csv")).unwrap();
    assert!(log.starts_with("t,cs.phi,fs.phi,wg.phi,cs_motor.tau,fs_motor.tau,wg_motor.tau,fs_torque.tau\n0,"));
    // What was written as the truth makes the same log; the text names plan and files.
    let truth = ["--truth", "a/truth.toml", "--seed", "5", "--out", "b"];
    let got = bench(&at, &[&["m.toml"][..], &truth].concat());
    assert_eq!(got.status.code(), Some(0), "{}", String::from_utf8_lossy(&got.stderr));
    assert_eq!(fs::read_to_string(at.join("b/harmonic-drive-bench-5.csv")).unwrap(), log);
    let (text, plan) = (String::from_utf8(got.stdout).unwrap(), fs::read_to_string(at.join("b/plan.txt")).unwrap());
    assert!(text.starts_with(&plan) && plan.contains("wg.damping") && text.contains("b/truth.toml"), "{text}");
    assert!(!plan.contains("0.001"), "the plan does not know the truth");
}

#[test]
fn controllers_of_the_file_run() {
    let at = folder("control");
    model(&at);
    let got = bench(&at, &["m.toml", "--control", "drive", "--json", "--out", "c"]);
    assert_eq!(got.status.code(), Some(0), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!(object["plan"], Value::Null);
    assert_eq!(object["truth"].as_array().unwrap().len(), 9);
    assert!(object["notes"][0].as_str().unwrap().contains("kardan drew"));
    assert!(!at.join("c/plan.txt").exists() && at.join("c/truth.toml").exists());
}

/// Excited, logged, identified from the file that was written, designed on the values found, run in simulation and on the plant.
#[test]
fn a_study_goes_the_whole_way() {
    let at = folder("study");
    let text = model(&at).replace("duration = \"5 s\"", "duration = \"1.3 s\"");
    fs::write(at.join("m.toml"), text.replace("points = 6", "points = 12")).unwrap();
    let got = bench(&at, &["m.toml", "--study", "--json", "--out", "s", "--format", "mdf,csv,csv"]);
    assert_eq!(got.status.code(), Some(0), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!(object["controller"], "drive");
    assert_eq!(object["files"].as_array().unwrap().len(), 2 + 2 + 1 + 8 + 1, "{}", object["files"]);
    for file in object["files"].as_array().unwrap() {
        assert!(at.join(file.as_str().unwrap()).exists(), "{file}");
    }
    assert!(object["identification"]["logs"][0]["name"].as_str().unwrap().ends_with(".mf4"));
    // What was drawn is found to some percent, and written with comments and order of the file.
    let truth = object["truth"].as_array().unwrap();
    let of = |name: &str| truth.iter().find(|one| one["name"] == name).unwrap()["value"].as_f64().unwrap();
    let found = object["identification"]["parameters"].as_array().unwrap();
    let friction = found.iter().find(|one| one["name"] == "cs.friction").unwrap()["value"].as_f64().unwrap();
    assert!((friction / of("cs.friction") - 1.0).abs() < 0.05, "{friction}");
    let identified = fs::read_to_string(at.join("s/identified.toml")).unwrap();
    assert!(identified.lines().next() == text.lines().next() && identified.contains("95 %"), "{identified}");
    let experiments = object["experiments"].as_array().unwrap();
    assert_eq!(experiments.len(), 2);
    for (experiment, output) in experiments.iter().zip([0, 1]) {
        let [one, other] = [output, 1 - output].map(|k| &experiment["responses"][k]);
        assert!(one["steady_state"]["simulation"].as_f64().unwrap() > 0.09, "{one}");
        assert!(other["max_deviation"]["simulation"].as_f64().unwrap() < 1e-6, "{other}");
        assert!(one["differences"].as_array().unwrap().len() >= 3);
    }
    let page = fs::read_to_string(at.join("s/report.html")).unwrap();
    for part in [
        "Simulation and bench: position",
        "Causes of the differences",
        "Identified and true values",
        "Excitation",
        "Design of drive",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN") && !page.contains("http://") && !page.contains("https://"));
    // The text says the same.
    let got = bench(&at, &["m.toml", "--study", "--out", "t", "-q"]);
    let stdout = String::from_utf8(got.stdout).unwrap();
    assert!(
        stdout.contains("Identified and true values") && stdout.contains("Simulation and bench: torque"),
        "{stdout}"
    );
}

#[test]
fn what_cannot_be_is_reported_and_leaves_no_folder() {
    let at = folder("wrong");
    let text = model(&at);
    fs::write(at.join("fast.toml"), text.replace("points = 6", "points = 900")).unwrap();
    fs::write(at.join("truth.toml"), "[bench.truth]\n\"gw.damping\" = \"1 N m s/rad\"\n").unwrap();
    for (arguments, part) in [
        (&["fast.toml"][..], "only 48 satisfy the limits"),
        (&["m.toml", "--study", "--control", "drve"], "did you mean `drive`?"),
        (&["rack-and-pinion", "--study"], "no controller to test"),
        (&["m.toml", "--truth", "truth.toml"], "there is no element `gw`"),
        (&["m.toml", "--truth", "nowhere.toml"], "there is no file `nowhere.toml`"),
        (&["m.toml", "--plan", "multisin"], "did you mean `multisine`?"),
        (&["m.toml", "--control", "drve"], "did you mean `drive`?"),
        (&["m.toml", "--repetitions", "0"], "0 is not in 1..=100000"),
        (&["harmonic-drive"], "has no speed limit"),
    ] {
        let got = bench(&at, arguments);
        let stderr = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(got.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(part) && !stderr.contains("panicked"), "{arguments:?}: {stderr}");
    }
    assert!(!at.join("kardan-out").exists());
}
