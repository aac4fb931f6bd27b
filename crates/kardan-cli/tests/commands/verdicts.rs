//! What `kardan run` and `kardan sweep` say of runs that reach their end with numbers that are wrong or in doubt: first line, exit code, JSON, reports.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use super::schemas::printed;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("verdicts_{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap().split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A universal joint near 90° between two free shafts keeps its energy, whatever it does; at this tolerance its peaks are lost.
const PEAKS: &str = "\
[shaft.a]
inertia = \"1 kg m^2 ± 1 %\"
[shaft.b]
inertia = \"1 kg m^2\"
[universal_joint.j]
shaft_1 = \"a\"
shaft_2 = \"b\"
angle = \"89.9 deg\"
[scenario]
duration = \"1.5 s\"
output_step = \"0.1 s\"
initial = { \"a.w\" = \"5 rad/s\" }
[[requirement]]
signal = \"a.phi\"
measure = \"max_abs\"
below = \"1e9 rad\"
";
const COARSE: [&str; 4] = ["--method", "dop853", "--tolerance", "1e-3"];

/// A run whose energy balance does not close is not completed, and its requirements are not met.
#[test]
fn an_energy_balance_that_does_not_close_is_no_completed_run() {
    let at = folder("energy");
    fs::write(at.join("m.toml"), PEAKS).unwrap();
    let with = |more: &[&str]| kardan(&at, &[&["run", "m.toml", "--out", "o"], &COARSE[..], more].concat());
    let got = with(&["--json"]);
    assert_eq!(got.status.code(), Some(2));
    let run = &printed(&got.stdout)["variants"][0];
    assert_eq!(run["outcome"]["completed"], false);
    assert_eq!(run["outcome"]["verdict"], "unbalanced");
    assert_eq!(run["outcome"]["time"], 1.5);
    assert!(run["outcome"]["cause"].as_str().unwrap().starts_with("the energy balance does not close"));
    assert_eq!(run["requirements"][0]["passed"], false);
    assert!(run["notes"].to_string().contains("All requirements count as not met"), "{}", run["notes"]);
    let headline = "The run completed, but its energy balance does not close, so that its numbers are wrong; the requirement is not met: max ";
    let got = with(&["--markdown"]);
    assert_eq!(got.status.code(), Some(2));
    assert!(text(&got.stdout).contains(headline), "{}", text(&got.stdout));
    assert!(text(&fs::read(at.join("o/report.md")).unwrap()).contains(headline));
    assert_eq!(with(&[]).status.code(), Some(2));
    assert!(text(&fs::read(at.join("o/report.html")).unwrap()).contains(headline));
    // Where nothing is lost it is a run like others.
    fs::write(at.join("m.toml"), PEAKS.replace("89.9 deg", "80 deg")).unwrap();
    let got = kardan(&at, &["run", "m.toml", "--out", "o", "--json"]);
    assert_eq!(
        (got.status.code(), &printed(&got.stdout)["variants"][0]["outcome"]["verdict"]),
        (Some(0), &"completed".into())
    );
}

/// A sweep counts them among the runs that failed, and takes no number from them.
#[test]
fn a_sweep_counts_runs_whose_energy_balance_does_not_close() {
    let at = folder("sweep");
    fs::write(at.join("m.toml"), PEAKS).unwrap();
    let got = kardan(&at, &[&["sweep", "m.toml", "--samples", "4", "--out", "o", "--json"], &COARSE[..]].concat());
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let found = printed(&got.stdout);
    let failure = &found["failures"][0];
    assert!(failure["reason"].as_str().unwrap().contains("the energy balance does not close"), "{failure}");
    assert_eq!((&failure["count"], &found["requirements"][0]["failed"]), (&4.into(), &4.into()));
    assert_eq!(found["requirements"][0]["measured"]["count"], 0);
}

/// The pendulum of Baker and Gollub (Chaotic Dynamics, 1990, q = 2, g = 1.2), whose motion no tolerance tells after a hundred periods.
const CHAOS: &str = "\
[shaft.a]
inertia = \"1 kg m^2\"
damping = \"0.5 N m s/rad\"
[torque.weight]
shaft = \"a\"
law = \"-1 N m * sin(a.phi)\"
[torque.drive]
shaft = \"a\"
law = \"1.2 N m * cos(2/3 rad/s * t)\"
[scenario]
duration = \"DURATION s\"
output_step = \"0.1 s\"
initial = { \"a.phi\" = \"0.2 rad\" }
";

/// A run whose errors are as large as its signals says so in its first line, and ends with another exit code if asked.
#[test]
fn errors_as_large_as_signals_are_reported_first() {
    let at = folder("errors");
    fs::write(at.join("long.toml"), CHAOS.replace("DURATION", "400")).unwrap();
    fs::write(at.join("short.toml"), CHAOS.replace("DURATION", "10")).unwrap();
    let with = |more: &[&str]| kardan(&at, &[&["run", "--out", "o"], more].concat());
    let got = with(&["long.toml", "--json"]);
    assert_eq!(got.status.code(), Some(0));
    let run = &printed(&got.stdout)["variants"][0];
    assert_eq!((&run["outcome"]["completed"], &run["outcome"]["verdict"]), (&true.into(), &"doubtful".into()));
    let unreliable = &run["accuracy"]["unreliable"];
    assert!(unreliable["error"].as_f64().unwrap() >= 0.1 * unreliable["size"].as_f64().unwrap(), "{unreliable}");
    assert!(run["warnings"][0].as_str().unwrap().contains("the estimated error of"), "{}", run["warnings"]);
    assert_eq!(with(&["long.toml", "--json", "--strict"]).status.code(), Some(1));
    let headline = "The run completed, but its numbers are doubtful; accuracy: the estimated error of a.phi is a tenth of the signal or more; no requirements are stated.";
    let got = with(&["long.toml", "--markdown"]);
    assert!(text(&got.stdout).contains(headline), "{}", text(&got.stdout));
    assert!(text(&fs::read(at.join("o/report.md")).unwrap()).contains(headline));
    let got = with(&["short.toml", "--json", "--strict"]);
    assert_eq!(
        (got.status.code(), &printed(&got.stdout)["variants"][0]["outcome"]["verdict"]),
        (Some(0), &"completed".into())
    );
    // Without a second run there is no estimate to be strict about.
    assert_eq!(with(&["short.toml", "--strict", "--runs-only"]).status.code(), Some(2));
}

/// A position loop on an arm, with three samples of delay, in two variants that a parameter tells apart.
const DELAYED: &str = "\
[parameters]
J = \"0.8 kg m^2\"
[shaft.arm]
inertia = \"J\"
[motor.drive]
shaft = \"arm\"
[control.position]
law = \"position_loop\"
output = \"arm.phi\"
input = \"drive\"
natural_frequency = \"FREQUENCY rad/s\"
reference = \"ref\"
sample_time = \"10 ms\"
delay = \"30 ms\"
[scenario]
duration = \"1 s\"
[[scenario.event]]
at = \"0.1 s\"
signal = \"ref\"
to = \"90 deg\"
[[variant]]
name = \"light\"
[[variant]]
name = \"heavy\"
set = { J = \"0.9 kg m^2\" }
[[requirement]]
signal = \"arm.phi\"
measure = \"max\"
below = \"97 deg\"
[[requirement]]
signal = \"arm.w\"
measure = \"max_abs\"
below = \"1000 rad/s\"
";

/// The first line names what is not met and the loop with low margins, and calls variants as the file does.
#[test]
fn the_first_line_names_what_is_wrong() {
    let at = folder("first");
    fs::write(at.join("slow.toml"), DELAYED.replace("FREQUENCY", "10")).unwrap();
    fs::write(at.join("fast.toml"), DELAYED.replace("FREQUENCY", "17")).unwrap();
    let with = |model: &str| kardan(&at, &["run", model, "--out", "o"]);
    let got = with("slow.toml");
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    assert!(
        text(&got.stdout).contains("All 2 variants completed; all 4 requirements are met."),
        "{}",
        text(&got.stdout)
    );
    let got = with("fast.toml");
    assert_eq!(got.status.code(), Some(1), "{}", text(&got.stderr));
    let headline = "2 of 4 requirements are met, 2 are not: max arm.phi < 97 deg (light, heavy); low margins: `position` has the disk margin 0.2";
    assert!(text(&got.stdout).contains(headline), "{}", text(&got.stdout));
}
