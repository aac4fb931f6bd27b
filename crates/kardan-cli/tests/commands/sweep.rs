//! `kardan sweep`: text, page, JSON and rows, its exit codes, and how it goes on.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use super::schemas::printed;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("sweep_{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().unwrap()
}

const MODEL: &str = "\
[shaft.a]
inertia = \"2 kg m^2 ± 10 %\"
[motor.m]
shaft = \"a\"
[scenario]
duration = \"1 s\"
[[scenario.event]]
signal = \"m.tau\"
at = \"0 s\"
to = \"4 N m\"
[[requirement]]
signal = \"a.w\"
measure = \"final\"
above = \"2 rad/s\"
";

/// The speed 4 N m s / J is above 2 rad/s in the lower half of the tolerance.
#[test]
fn half_of_the_samples_hold() {
    let at = folder("half");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "150", "--out", "o", "--json"]);
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!(object["requirements"][0]["passed"], 75);
    let files = ["rows-000000.parquet", "rows-000001.parquet", "rows-000002.parquet", "sweep.html", "sweep.json"];
    assert!(files.iter().all(|name| at.join("o").join(name).is_file()));
    let told = kardan(&at, &["sweep", "m.toml", "--samples", "150"]);
    let text = String::from_utf8(told.stdout).unwrap();
    assert!(text.contains("1 of 1 requirements fail in some of 150 runs") && text.contains("50 %"), "{text}");
}

/// What is missing is made, and nothing else; rows of another sweep are refused.
#[test]
fn it_goes_on_where_it_ended() {
    let at = folder("resume");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let sweep =
        |more: &[&str]| kardan(&at, &[&["sweep", "m.toml", "--samples", "150", "--out", "o", "--json"], more].concat());
    let first = sweep(&[]);
    let bytes = |block: u32| fs::read(at.join(format!("o/rows-{block:06}.parquet"))).unwrap();
    let before = [bytes(0), bytes(1), bytes(2)];
    fs::remove_file(at.join("o/rows-000001.parquet")).unwrap();
    let kept = fs::metadata(at.join("o/rows-000000.parquet")).unwrap().modified().unwrap();
    let again = sweep(&["--resume"]);
    assert_eq!(printed(&again.stdout), printed(&first.stdout));
    assert_eq!([bytes(0), bytes(1), bytes(2)], before);
    assert_eq!(fs::metadata(at.join("o/rows-000000.parquet")).unwrap().modified().unwrap(), kept);
    for (more, told) in [(&[][..], "holds rows of a sweep already"), (&["--resume", "--seed", "3"], "of another sweep")]
    {
        let got = sweep(more);
        assert_eq!(got.status.code(), Some(2));
        let error = printed(&got.stdout).to_string();
        assert!(error.contains(told), "{error}");
    }
    fs::write(at.join("o/rows-000001.parquet"), b"PAR1").unwrap();
    assert!(printed(&sweep(&["--resume"]).stdout).to_string().contains("cannot be gone on with"));
    assert_eq!(sweep(&["--force", "--seed", "3"]).status.code(), Some(1));
}

/// A sweep that is ended keeps its blocks, and says how much is missing.
#[test]
fn an_ended_sweep_keeps_its_blocks() {
    let at = folder("ended");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "10000000", "--time-limit", "2", "--out", "o", "--json"]);
    assert_eq!(got.status.code(), Some(2), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    let rows = object["rows"].as_u64().unwrap();
    assert_eq!(rows + object["missing"].as_u64().unwrap(), 10_000_000);
    let warnings = object["warnings"].to_string();
    assert!(warnings.contains("is missing"), "{warnings}");
}

#[test]
fn nonsense_is_refused() {
    let at = folder("nonsense");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    fs::write(at.join("same.toml"), MODEL.replace(" ± 10 %", "")).unwrap();
    for (arguments, told) in [
        (&["sweep", "same.toml"][..], "nothing in the file varies"),
        (&["sweep", "m.toml", "--samples", "0"], "0 samples"),
        (&["sweep", "m.toml", "--samples", "20000000"], "20000000 samples"),
        (&["sweep", "m.toml", "--variant", "nobody"], "there is no variant `nobody`"),
        (&["sweep", "m.toml", "--resume"], "--out"),
        (&["sweep", "m.toml", "--out", "m.toml"], "exists already and is a file"),
    ] {
        let got = kardan(&at, arguments);
        let error = String::from_utf8_lossy(&got.stderr).replace(['\n', '│'], " ");
        let error = error.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(got.status.code() == Some(2) && error.contains(told), "{arguments:?}: {error}");
    }
}
