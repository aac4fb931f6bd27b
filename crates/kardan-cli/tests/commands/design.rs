//! `kardan design` as its users meet it: text, JSON, files, and what it says when it cannot be done.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use super::schemas::printed;

fn design(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).arg("design").args(arguments).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Miette's frame and line breaks taken out.
fn plain_text(bytes: &[u8]) -> String {
    text(bytes).replace(['│', '×', '╰', '─', '▶'], " ").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A fresh folder of the test's own.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("design").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

/// A built-in model.
fn model(name: &str) -> String {
    let print = Command::new(env!("CARGO_BIN_EXE_kardan")).args(["models", name]).output().unwrap();
    assert!(print.status.success());
    text(&print.stdout)
}

#[track_caller]
fn changed(name: &str, from: &str, to: &str) -> String {
    let source = model(name);
    assert!(source.contains(from), "{name} has no {from:?}");
    source.replacen(from, to, 1)
}

const BOTH: [&str; 2] = ["--inputs", "wg_motor,rk_motor"];

#[test]
fn text_shows_the_verdict_the_gains_and_the_warnings() {
    let at = folder("text");
    let got = design(&at, &["harmonic-drive-spring", "--no-simulation"]);
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let stdout = plain_text(&got.stdout);
    // L and the zeros of the source, section 6.2.
    for part in [
        "Decoupled by static state feedback, proven exactly",
        "; stable in continuous time",
        "In continuous time the loop is marginal (decided exactly): a free motion at constant speed",
        "the zero dynamics are marginal",
        "WARNING: the zero at 0 1/s is at zero",
        "-2601/250",
        "400/(s^2 + 28 s + 400)",
        "20/(s + 20)",
        "s^2 + 10000 s",
        "0 (exact)",
        "x4 0 0 -5202 -10000 -2601/50",
    ] {
        assert!(stdout.contains(part), "no {part:?} in {stdout}");
    }
    // Without a model: the steering, with what its simulation measures.
    let got = design(&at, &[]);
    assert_eq!(got.status.code(), Some(0));
    let stdout = plain_text(&got.stdout);
    assert!(stdout.contains("9.821 %") && stdout.contains("11 s^2 + 2060 s + 10000000"), "{stdout}");
    assert!(text(&got.stdout).lines().all(|line| line.chars().count() <= 100), "wider than 100 columns");
}

#[test]
fn json_is_one_object_for_every_request() {
    let at = folder("json");
    let required = [
        "law",
        "states",
        "inputs",
        "outputs",
        "relative_degrees",
        "decoupling_matrix",
        "gains",
        "closed_loop_poles",
        "zero_dynamics",
        "cross_coupling",
    ];
    let cases: &[&[&str]] = &[
        &["sia-steering"],
        &["harmonic-drive"],
        &["harmonic-drive", "--variant", "position-observer"],
        &["harmonic-drive-spring"],
        &["two-bodies"],
        &["harmonic-drive-spring", BOTH[0], BOTH[1], "--outputs", "rk.phi,fs.phi"],
        &["sia-steering", BOTH[0], BOTH[1], "--outputs", "fs.phi,cj.phi", "--feedback", "dynamic"],
        &["sia-steering", "--law", "noninteracting", BOTH[0], BOTH[1], "--outputs", "fs.phi,rk.phi"],
    ];
    for case in cases {
        let got = design(&at, &[case, &["--json"][..]].concat());
        assert_eq!(got.status.code(), Some(0), "{case:?}: {}", plain_text(&got.stderr));
        let found = printed(&got.stdout);
        for key in required {
            assert!(!found[key].is_null(), "{case:?}: no {key}");
        }
        assert!(found["zero_dynamics"]["poles"].is_array() && found["zero_dynamics"]["stable"].is_boolean());
        assert!(found["gains"].as_object().unwrap().values().all(|gain| gain["exact"].is_array()), "{case:?}");
        let coupling = found["cross_coupling"].as_array().unwrap();
        assert!(!coupling.is_empty() && coupling.iter().all(|entry| entry["peak"].is_f64()), "{case:?}");
        let quick = design(&at, &[case, &["--json", "--no-simulation"][..]].concat());
        let mut no_simulation = printed(&quick.stdout);
        assert_eq!(no_simulation["cross_coupling"], Value::Array(Vec::new()));
        no_simulation["cross_coupling"] = found["cross_coupling"].clone();
        // Torques that steps ask for are simulated, and told in the verdict.
        assert_eq!(no_simulation["margins"]["peaks"], Value::Array(Vec::new()));
        assert!(!found["margins"]["peaks"].as_array().unwrap().is_empty(), "{case:?}");
        for key in ["peaks", "verdict"] {
            no_simulation["margins"][key] = found["margins"][key].clone();
        }
        assert_eq!(no_simulation, found, "{case:?}: the simulation changes the design");
    }
}

#[test]
fn controller_and_report_are_written() {
    let at = folder("files");
    let arguments =
        ["harmonic-drive-spring", "--no-simulation", "--json", "--controller", "new/c.json", "--report", "r.html"];
    for _ in 0..2 {
        // The second time both are replaced.
        let got = design(&at, &arguments);
        assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
        let stderr = plain_text(&got.stderr);
        assert!(stderr.contains("wrote new/c.json") && stderr.contains("wrote r.html"), "{stderr}");
        let controller: Value = serde_json::from_slice(&fs::read(at.join("new/c.json")).unwrap()).unwrap();
        assert_eq!(controller["format"], "kardan-controller");
        assert_eq!((controller["block"].as_str(), controller["sample_time_s"].is_null()), (Some("StateSpace"), true));
        // u = D [phi; w; r]: the last columns are L of the source.
        let rows = controller["matrices"]["D"].as_array().unwrap();
        let reads = controller["reads"].as_array().unwrap();
        assert_eq!((rows.len(), reads.len()), (2, 8));
        assert_eq!((rows[0][6].as_f64(), rows[0][7].as_f64()), (Some(2.04), Some(-10.404)));
        assert_eq!((rows[1][6].as_f64(), rows[1][7].as_f64()), (Some(20.0), Some(0.0)));
        assert_eq!((reads[6]["signal"].as_str(), reads[7]["unit"].as_str()), (Some("ref_rk"), Some("N m")));
        let page = fs::read_to_string(at.join("r.html")).unwrap();
        assert!(page.trim_start().to_lowercase().starts_with("<!doctype html>"));
        for part in ["harmonic-drive-spring", "decoupled", "-2601/250"] {
            assert!(page.replace('−', "-").contains(part), "no {part} in the page");
        }
        assert!(!page.contains("http://") || !page.contains("<script src="), "the page loads something");
    }
    let quiet = design(&at, &[&arguments[..], &["--quiet"]].concat());
    // What the model is warned of is said all the same.
    let stderr = plain_text(&quiet.stderr);
    assert!(
        quiet.status.code() == Some(0) && !stderr.contains("wrote") && stderr.contains("control::low-margins"),
        "{stderr}"
    );
}

#[test]
fn the_same_design_gives_the_same_bytes() {
    let at = folder("bytes");
    for case in [&["sia-steering", "--json"][..], &["harmonic-drive", "--json", "--variant", "torque-observer"]] {
        assert_eq!(design(&at, case).stdout, design(&at, case).stdout, "{case:?}");
    }
}

/// Exit code 2, words on stderr, nothing on stdout, no file left; the same in the JSON object.
#[track_caller]
fn refused(at: &Path, arguments: &[&str], code: &str, parts: &[&str]) {
    let got = design(at, &[arguments, &["--report", "left.html", "--controller", "left.json"][..]].concat());
    let stderr = plain_text(&got.stderr);
    assert_eq!(got.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(got.stdout.is_empty() && !stderr.contains("panicked"), "{arguments:?}: {stderr}");
    assert!(!at.join("left.html").exists() && !at.join("left.json").exists(), "{arguments:?} leaves files behind");
    for part in parts.iter().chain([&code]) {
        assert!(stderr.contains(part), "{arguments:?} does not say {part:?}: {stderr}");
    }
    let got = design(at, &[arguments, &["--json"]].concat());
    assert_eq!(got.status.code(), Some(2));
    let diagnostics = printed(&got.stdout)["error"]["diagnostics"].clone();
    let codes: Vec<&str> = diagnostics.as_array().unwrap().iter().filter_map(|one| one["code"].as_str()).collect();
    assert!(codes.contains(&code), "{arguments:?}: {codes:?}");
}

#[test]
fn what_cannot_be_designed_is_explained() {
    let at = folder("refused");
    let steering_args = |outputs: &'static str| vec!["sia-steering", BOTH[0], BOTH[1], "--outputs", outputs];
    refused(
        &at,
        &steering_args("fs.phi,cj.phi"),
        "control::design",
        &["rank 1 instead of 2", "feedback = \"dynamic\""],
    );
    refused(
        &at,
        &steering_args("fs.phi,rk.phi,cj.phi"),
        "control::design",
        &["no feedback at all", "3 outputs, 2 inputs"],
    );
    refused(&at, &steering_args("fs.phi,fs.phi"), "name::duplicate", &["`fs.phi` is named twice"]);
    refused(&at, &steering_args("fs.phi,rk.ph"), "name::unknown", &["`rk.ph`", "did you mean `rk.phi`?"]);
    let three = ["sia-steering", "--inputs", "wg_motor,rk_motor,driver", "--outputs", "fs.phi,wg.phi,cs.phi"];
    refused(
        &at,
        &three,
        "control::design",
        &["50 fs.phi + wg.phi - 51 cs.phi = 0", "the harmonic drive `hd` ties them together"],
    );
    refused(&at, &["--control", "colum"], "name::unknown", &["no controller `colum`", "did you mean `column`?"]);
    refused(&at, &["--variant", "beta-40deg"], "variant::unknown", &["`beta-40deg`"]);
    refused(&at, &["--feedback", "block"], "control::feedback", &["`noninteracting`", "leave `--feedback` out"]);
    let law = ["--law", "decuopling", BOTH[0], BOTH[1], "--outputs", "fs.phi,rk.phi"];
    refused(&at, &law, "name::unknown", &["no law `decuopling`", "did you mean `decoupling`?"]);
    refused(&at, &["rlc-ladder"], "control::no-motor", &["no motor"]);
}

#[test]
fn files_that_cannot_be_designed_are_explained_at_their_place() {
    let at = folder("places");
    let frequency = "natural_frequency = \"20 rad/s\"\ndamping_ratio = 0.7\n";
    let poles = "poles = [-200, -210, -220]\n";
    let sensors = "sensors = [\"wg.phi\", \"rk.phi\", \"fs.phi\"]";
    let cases: &[(&str, &str, &str, &str, &[&str])] = &[
        (
            frequency,
            "poles = [\"-14 + 3j\", -5]\n",
            "",
            "control::design",
            &["the conjugate of the pole", "[m.toml:81:10]"],
        ),
        (frequency, "poles = [-14, -15, -16]\n", "", "control::design", &["there are 3", "give 2 poles"]),
        (frequency, "poles = [14, -15]\n", "", "control::design", &["real part 14 is not stable"]),
        (frequency, "natural_frequency = \"1e200 rad/s\"\n", "", "number::range", &["too large"]),
        ("output = \"fs_torque\"", "output = \"fs_torqe\"", "", "name::unknown", &["fs_torqe", "fs_torque"]),
        (poles, "", "position-observer", "control::design", &["the observer needs `poles`"]),
        (poles, "poles = [200, -210, -220]\n", "position-observer", "control::design", &["would not die out"]),
        (sensors, "sensors = [\"wg.phi\"]", "position-observer", "control::design", &["only 5 of 8 states"]),
    ];
    for (from, to, variant, code, parts) in cases {
        fs::write(at.join("m.toml"), changed("harmonic-drive-spring", from, to)).unwrap();
        let choice = if variant.is_empty() { Vec::new() } else { vec!["--variant", variant] };
        refused(&at, &[&["m.toml"], &choice[..]].concat(), code, parts);
    }
    let sampled =
        changed("harmonic-drive-spring", "law = \"decoupling\"\n", "law = \"decoupling\"\nsample_time = \"2 s\"\n");
    fs::write(at.join("m.toml"), sampled).unwrap();
    refused(&at, &["m.toml"], "control::design", &["a sample time of 2 s is longer than 1 s"]);
}

#[test]
fn conflicting_arguments_are_refused() {
    let at = folder("arguments");
    let cases: &[&[&str]] = &[
        &["--control", "column", "--inputs", "wg_motor", "--outputs", "rk.phi"],
        &["--feedback", "sometimes"],
        &["--report"],
        &["a.toml", "b.toml"],
    ];
    for case in cases {
        let got = design(&at, case);
        assert_eq!(got.status.code(), Some(2), "{case:?}");
        assert!(got.stdout.is_empty() && plain_text(&got.stderr).contains("--help"), "{case:?}");
    }
    fs::create_dir(at.join("taken")).unwrap();
    for flag in ["--report", "--controller"] {
        let got = design(&at, &["two-bodies", flag, "taken"]);
        assert_eq!(got.status.code(), Some(2));
        assert!(plain_text(&got.stderr).contains("output::file"), "{}", plain_text(&got.stderr));
    }
}

#[test]
fn a_model_comes_from_standard_input_as_well() {
    use std::io::Write;
    let mut child = Command::new(env!("CARGO_BIN_EXE_kardan"))
        .args(["design", "-", "--json", "--no-simulation"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    child.stdin.take().unwrap().write_all(model("harmonic-drive-spring").as_bytes()).unwrap();
    let got = child.wait_with_output().unwrap();
    assert_eq!(got.status.code(), Some(0), "{}", plain_text(&got.stderr));
    let direct = design(&folder("standard_input"), &["harmonic-drive-spring", "--json", "--no-simulation"]);
    assert_eq!(printed(&got.stdout), printed(&direct.stdout));
}
