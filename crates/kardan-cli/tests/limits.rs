//! Limits and signals end commands, with what they have: files that are whole, a clear word, exit code 2.

#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;

/// 1e15 1/s: no computer gets through a second of it.
const ENDLESS: &str = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-9 kg m^2\"\n[spring_damper.d]\nshaft_1 = \"a\"\n\
    shaft_2 = \"b\"\ndamping = \"1e6 N m s/rad\"\n[disturbance.T]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
    [[scenario.event]]\nat = \"0 s\"\nsignal = \"T\"\nto = \"1 N m\"\n";

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    fs::write(path.join("endless.toml"), ENDLESS).unwrap();
    path
}

fn kardan(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(folder)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap()
}

/// What a process of ours says when it ends; one that does not within two minutes is killed, and the test fails.
fn ended(mut child: Child) -> Output {
    for _ in 0..1200 {
        if child.try_wait().unwrap().is_some() {
            return child.wait_with_output().unwrap();
        }
        sleep(Duration::from_millis(100));
    }
    child.kill().unwrap();
    panic!("it does not end: {:?}", child.wait_with_output());
}

fn signal(child: &Child, name: &str) {
    let done = Command::new("kill").args([name, &child.id().to_string()]).status().unwrap();
    assert!(done.success());
}

/// The tables and the report of a run that ended early are whole, and say that it did.
fn is_marked(folder: &Path, out: &Output, cause: &str) {
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    let json: Value = serde_json::from_slice(&out.stdout).unwrap_or_else(|_| panic!("{out:?}"));
    let outcome = &json["variants"][0]["outcome"];
    assert_eq!(outcome["completed"], false, "{outcome}");
    assert!(outcome["cause"].as_str().unwrap().contains(cause), "{outcome}");
    let files: Vec<PathBuf> = fs::read_dir(folder.join("out")).unwrap().map(|entry| entry.unwrap().path()).collect();
    let table = files.iter().find(|path| path.extension().is_some_and(|e| e == "csv")).expect("a table");
    let table = fs::read_to_string(table).unwrap();
    assert!(table.ends_with('\n'));
    let columns: Vec<usize> =
        table.lines().filter(|line| !line.starts_with('#')).map(|line| line.split(',').count()).collect();
    assert!(columns.len() >= 2 && columns.iter().all(|count| *count == columns[0]), "{columns:?}");
    let report = fs::read_to_string(folder.join("out/report.html")).unwrap();
    assert!(report.trim_end().ends_with("</html>") && report.contains(cause));
    assert!(files.iter().all(|path| !path.to_string_lossy().ends_with(".part")), "{files:?}");
}

#[test]
fn steps_and_seconds_are_limited() {
    for (name, limit, cause) in [
        ("max_steps", ["--max-steps", "2000"], "more than 2000 steps"),
        ("time_limit", ["--time-limit", "0.5"], "time limit of 0.5 s"),
    ] {
        let at = folder(name);
        let arguments = [&["run", "endless.toml", "--json", "--out", "out"][..], &limit[..]].concat();
        let out = ended(kardan(&at, &arguments));
        is_marked(&at, &out, cause);
        // Told before the run began, with the element.
        let told = String::from_utf8_lossy(&out.stderr);
        assert!(told.contains("run::steps") && told.contains("`d`"), "{told}");
    }
    let at = folder("limits");
    for wrong in [
        ["--max-steps", "0"],
        ["--time-limit", "0"],
        ["--time-limit", "-1"],
        ["--time-limit", "soon"],
        ["--time-limit", "inf"],
    ] {
        let out = ended(kardan(&at, &[&["run", "endless.toml"][..], &wrong[..]].concat()));
        assert_eq!(out.status.code(), Some(2), "{wrong:?}");
    }
}

#[test]
fn a_signal_ends_a_run_with_what_it_has() {
    for name in ["-INT", "-TERM"] {
        let at = folder(&format!("signal{name}"));
        let child = kardan(&at, &["run", "endless.toml", "--json", "--out", "out"]);
        // The folder is there before the run begins, and the run has no end of its own.
        while !at.join("out").exists() {
            sleep(Duration::from_millis(20));
        }
        sleep(Duration::from_millis(500));
        signal(&child, name);
        let out = ended(child);
        is_marked(&at, &out, "stopped by a signal");
        assert!(String::from_utf8_lossy(&out.stderr).contains("what is there is kept"));
    }
}

/// A bench under its controllers, endless too: its log is whole and says that it ended early.
#[test]
fn a_limit_ends_a_bench() {
    let at = folder("bench");
    let out = ended(kardan(&at, &["bench", "--max-steps", "500", "--out", "out"]));
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    let told = String::from_utf8_lossy(&out.stderr);
    assert!(told.contains("ends early") && told.contains("more than 500 steps"), "{told}");
    let logs: Vec<_> = fs::read_dir(at.join("out")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(logs.iter().any(|path| path.extension().is_some_and(|e| e == "csv")), "{logs:?}");
}

/// What has no partial results ends too, and says so.
#[test]
fn a_signal_ends_what_has_nothing_to_keep() {
    let at = folder("nothing_to_keep");
    // A pipe that nobody writes to: the model is waited for.
    let child = Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(&at)
        .args(["analyze", "-", "--json"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.unwrap();
    let open = child.stdin.take();
    sleep(Duration::from_millis(500));
    signal(&child, "-INT");
    let out = ended(child);
    drop(open);
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    assert!(String::from_utf8_lossy(&out.stderr).contains("no partial results"), "{out:?}");
    let json: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(json["error"].to_string().contains("stopped by a signal"), "{json}");
}
