//! Limits and signals end commands, with what they have: files that are whole, a clear word, exit code 2.

use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;

use serde_json::Value;

use super::schemas::printed;

/// 1e15 1/s: with steps of an explicit method no computer gets through a second of it.
const ENDLESS: &str = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1e-9 kg m^2\"\n[spring_damper.d]\nshaft_1 = \"a\"\n\
    shaft_2 = \"b\"\ndamping = \"1e6 N m s/rad\"\n[disturbance.T]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
    [[scenario.event]]\nat = \"0 s\"\nsignal = \"T\"\nto = \"1 N m\"\n";

const RUN: [&str; 7] = ["run", "endless.toml", "--method", "taylor", "--json", "--out", "out"];

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
    let json = printed(&out.stdout);
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
        let arguments = [&RUN[..], &limit[..]].concat();
        let out = ended(kardan(&at, &arguments));
        is_marked(&at, &out, cause);
        // Told before the run began, with the element.
        let reported = String::from_utf8_lossy(&out.stderr);
        assert!(reported.contains("run::steps") && reported.contains("`d`"), "{reported}");
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
        let child = kardan(&at, &RUN);
        // The folder is there before the run begins, and the run has no end of its own.
        while !at.join("out").exists() {
            sleep(Duration::from_millis(20));
        }
        sleep(Duration::from_millis(500));
        signal(&child, name);
        let out = ended(child);
        is_marked(&at, &out, "stopped by a signal");
        assert!(String::from_utf8_lossy(&out.stderr).contains("kardan keeps the results until then"));
    }
}

/// A sweep finishes the block that is begun, writes it, and says how to go on.
#[test]
fn a_signal_lets_a_sweep_finish_its_block() {
    let at = folder("signal-sweep");
    let text = "[shaft.a]\ninertia = \"1 kg m^2 ± 10 %\"\n[disturbance.T]\nshaft = \"a\"\n[scenario]\nduration = \"10 ms\"\n\
                [[requirement]]\nsignal = \"a.phi\"\nmeasure = \"max_abs\"\nbelow = \"1 rad\"\n";
    fs::write(at.join("many.toml"), text).unwrap();
    let child = kardan(&at, &["sweep", "many.toml", "--samples", "1000000", "--out", "out", "--json"]);
    while !at.join("out/rows-000000.parquet").exists() {
        sleep(Duration::from_millis(20));
    }
    signal(&child, "-INT");
    let out = ended(child);
    let reported = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(2) && reported.contains("kardan finishes and writes"), "{reported}");
    let json = printed(&out.stdout);
    let files = fs::read_dir(at.join("out")).unwrap().filter_map(Result::ok);
    let blocks = files.filter(|file| file.path().extension().is_some_and(|end| end == "parquet")).count();
    assert_eq!(
        (json["rows"].as_u64(), json["failures"].as_array().map(Vec::len)),
        (Some(1000 * blocks as u64), Some(0))
    );
    assert!(
        json["notes"].to_string().contains("--resume") && json["warnings"].to_string().contains("stopped by a signal")
    );
}

/// A bench under its controllers, endless too: its log is whole and says that it ended early.
#[test]
fn a_limit_ends_a_bench() {
    let at = folder("bench");
    let out = ended(kardan(&at, &["bench", "--max-steps", "500", "--out", "out"]));
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    let reported = String::from_utf8_lossy(&out.stderr);
    assert!(reported.contains("ends early") && reported.contains("more than 500 steps"), "{reported}");
    let logs: Vec<_> = fs::read_dir(at.join("out")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(logs.iter().any(|path| path.extension().is_some_and(|e| e == "csv")), "{logs:?}");
}

/// A system of n states with small whole numbers near the diagonal and some elsewhere.
fn state_space(n: u64) -> String {
    let mut seed = 7_u64;
    let mut digit = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) % 19
    };
    let mut rows: Vec<Vec<i64>> = vec![vec![0; n as usize]; n as usize];
    for (i, row) in rows.iter_mut().enumerate() {
        for j in i.saturating_sub(1)..(i + 2).min(n as usize) {
            row[j] = digit() as i64 - 9;
        }
        let far = (digit() * 19 + digit()) % n;
        row[far as usize] = digit() as i64 - 9;
    }
    let ports: Vec<i64> = (0..n).map(|_| digit() as i64 - 9).collect();
    let columns: Vec<Vec<i64>> = ports.iter().map(|x| vec![*x]).collect();
    serde_json::json!({ "A": rows, "B": columns, "C": [ports] }).to_string()
}

/// A command that is stopped as by a signal where `fault` says: what it prints, as JSON and in words; nothing if it came to its end
/// before. Stopped it ends with exit code 2, and nothing half written stays.
fn stopped(at: &Path, arguments: &[&str], fault: &str) -> Option<(Value, String)> {
    let child = Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(at)
        .args(arguments)
        .env("KARDAN_FAULT", fault)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let out = child.unwrap().wait_with_output().unwrap();
    let reported = String::from_utf8(out.stderr).unwrap();
    let json = printed(&out.stdout);
    for file in fs::read_dir(at).unwrap().chain(fs::read_dir(at.join("out")).into_iter().flatten()) {
        assert!(file.unwrap().path().extension().is_none_or(|e| e != "part"));
    }
    let ended_early = reported.contains("stopped by a signal");
    assert_eq!(out.status.code(), Some(if ended_early { 2 } else { 0 }), "{arguments:?}, {fault}: {reported}");
    ended_early.then_some((json, reported))
}

/// Stops a command wherever it keeps something, in order, and looks at what it shows each time; at least this often.
fn stopped_everywhere(at: &Path, arguments: &[&str], least: usize, check: &mut dyn FnMut(Value, String)) {
    let mut count = 0;
    while let Some((json, reported)) = stopped(at, arguments, &format!("kept:{count}")) {
        check(json, reported);
        count += 1;
    }
    assert!(count >= least, "{arguments:?} keeps something {count} times");
}

/// Marked in the JSON and on the page, which is whole.
fn is_unfinished(at: &Path, json: &Value, missing: &str) {
    let why = json["incomplete_reason"].as_str().unwrap();
    assert!(json["complete"] == false && why.contains("stopped by a signal") && why.contains(missing), "{why}");
    let page = fs::read_to_string(at.join("page.html")).unwrap();
    assert!(page.trim_end().ends_with("</html>") && page.contains("stopped by a signal"), "{why}");
}

#[test]
fn a_signal_keeps_what_an_analysis_has() {
    let at = folder("signal-analyze");
    fs::write(at.join("large.json"), state_space(40)).unwrap();
    let arguments = ["analyze", "--state-space", "large.json", "--json", "--report", "page.html"];
    stopped_everywhere(&at, &arguments, 1, &mut |json, _| {
        assert_eq!(json["states"], 40);
        assert!(json["controllable"].is_boolean() && json["certificate"]["proven"] == false);
        is_unfinished(&at, &json, if json["modes"] == Value::Array(Vec::new()) { "modes" } else { "inputs" });
    });
    // Of proofs asked for what was found before stays, and claims no proof.
    let mut unproven = 0;
    stopped_everywhere(&at, &[&arguments[..], &["--certify"]].concat(), 2, &mut |json, _| {
        let proven = json["certificate"]["proven"].as_bool().unwrap();
        is_unfinished(&at, &json, if proven { "inputs" } else { "requested proofs" });
        unproven += usize::from(!proven);
    });
    assert_eq!(unproven, 1);
}

#[test]
fn a_signal_keeps_what_a_design_has() {
    let at = folder("signal-design");
    let arguments =
        ["design", "sia-joint-angle", "--tolerance", "20%", "--no-simulation", "--json", "--report", "page.html"];
    let mut margins = 0;
    stopped_everywhere(&at, &arguments, 2, &mut |json, _| {
        assert!(json["warnings"].is_array() && !json["controller_data"].as_object().unwrap().is_empty());
        margins += usize::from(json["margins"].is_object());
        is_unfinished(&at, &json, "");
    });
    assert!(margins > 0);
}

/// What was read of the logs is fitted; the model is not written over with it.
#[test]
fn a_signal_keeps_what_an_identification_has() {
    let at = folder("signal-identify");
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
    fs::write(at.join("model.toml"), model).unwrap();
    let mut log = String::from("time,a.w,m.tau\ns,rad/s,N m\n");
    for k in 0..20_000_u32 {
        let speed = f64::from(1 + k / 500 % 9);
        let _ = writeln!(log, "{:.3},{speed},{:.4}", 0.001 * f64::from(k), 2.0 * speed + 1e-3 * f64::from(k % 7));
    }
    fs::write(at.join("0.csv"), log).unwrap();
    let names: Vec<String> = (0..8).map(|k| format!("{k}.csv")).collect();
    for name in &names[1..] {
        fs::hard_link(at.join("0.csv"), at.join(name)).unwrap();
    }
    let mut arguments = vec!["identify", "model.toml", "--json", "--report", "page.html", "--write", "model.toml"];
    arguments.extend(names.iter().map(String::as_str));
    let partial_result = |(json, reported): (Value, String), missing: &str| {
        assert!(json["reliable"] == false, "{json}");
        is_unfinished(&at, &json, missing);
        assert!(reported.contains("is not written: the identification is not complete"), "{reported}");
        assert_eq!(fs::read_to_string(at.join("model.toml")).unwrap(), model);
        (json["logs"].as_array().unwrap().len(), json["parameters"][0]["value"].as_f64())
    };
    // In the middle of the logs.
    let (read, found) =
        partial_result(stopped(&at, &arguments, "asked:3").expect("it asks once for each log"), "of the logs");
    assert!((1..names.len()).contains(&read), "{read}");
    assert!((found.unwrap() - 2.0).abs() < 1e-3, "{found:?}");
    // And behind them.
    stopped_everywhere(&at, &arguments[..8], 1, &mut |json, reported| {
        assert_eq!(partial_result((json, reported), "").0, 1)
    });
}

/// Runs that are complete stay complete while the designs of their report are computed.
#[test]
fn a_signal_keeps_complete_runs() {
    let at = folder("signal-run");
    let model = include_str!("../../../../models/sia-steering-ecu.toml").split("[[requirement]]").next().unwrap();
    let model = model.replace("\nduration = \"1.5 s\"", "\nduration = \"0.12 s\"");
    fs::write(at.join("short.toml"), model).unwrap();
    let arguments = ["run", "short.toml", "--variant", "rack", "--json", "--out", "out"];
    let (json, reported) = stopped(&at, &arguments, "kept:0").expect("runs are kept");
    assert_eq!(json["variants"][0]["outcome"]["completed"], true);
    assert!(json["warnings"].to_string().contains("stopped by a signal"), "{}", json["warnings"]);
    assert!(reported.contains("designs of the report are missing"), "{reported}");
    assert!(fs::read_to_string(at.join("out/rack.csv")).unwrap().ends_with('\n'));
    let page = fs::read_to_string(at.join("out/report.html")).unwrap();
    assert!(page.trim_end().ends_with("</html>") && page.contains("stopped by a signal"));
}

/// The logs of a study are there, whole, and named; the study is missing.
#[test]
fn a_signal_keeps_the_logs_of_a_study() {
    let at = folder("signal-study");
    let model = "[shaft.a]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.1 N m s/rad\"\nfriction = \"0.1 N m\"\n[motor.m]\nshaft = \"a\"\n\
        [control.hold]\nlaw = \"position_loop\"\ninput = \"m\"\noutput = \"a.phi\"\nreference = \"wish\"\nsample_time = \"1 ms\"\n\
        [scenario]\nduration = \"1 s\"\noutput_step = \"1 s\"\n[[scenario.event]]\nsignal = \"wish\"\nat = \"50 ms\"\n\
        to = \"0.1 rad\"\n[bench]\nspeed_limit = { a = \"60 rad/s\" }\npoints = 3\ndwell = \"1 s\"\n";
    fs::write(at.join("model.toml"), model).unwrap();
    // Before it identifies, and before the loops run.
    let arguments = ["bench", "model.toml", "--study", "--json", "--out", "out"];
    stopped_everywhere(&at, &arguments, 2, &mut |json, reported| {
        let logs = json["logs"].as_array().unwrap();
        assert!(logs.iter().all(|log| log["outcome"] == "completed"));
        let log = logs[0]["files"][0].as_str().unwrap();
        assert!(fs::read_to_string(at.join(log)).unwrap().ends_with('\n'));
        assert!(json["identification"].is_null() && reported.contains("the study is not complete"), "{reported}");
    });
}

/// A real signal, wherever it arrives: in time it ends what is computed, too late it changes nothing.
#[test]
fn a_signal_at_any_time_leaves_nothing_half_done() {
    let at = folder("signal-any-time");
    let arguments = ["run", "sia-steering", "--json", "--out", "out"];
    for wait in [10, 50, 100, 200, 400, 800, 1600, 3200] {
        let child = kardan(&at, &arguments);
        sleep(Duration::from_millis(wait));
        // It may have ended by itself.
        let _ = Command::new("kill").args(["-INT", &child.id().to_string()]).stderr(Stdio::null()).status().unwrap();
        let out = ended(child);
        let json = if out.stdout.is_empty() { Value::Null } else { printed(&out.stdout) };
        let is_marked = json.to_string().contains("stopped by a signal");
        match out.status.code() {
            Some(0) => assert!(!is_marked, "{wait} ms: {json}"),
            Some(2) => assert!(is_marked, "{wait} ms: {json}"),
            // Before it listens the signal ends it.
            code => assert!(code.is_none() && json.is_null(), "{wait} ms: {out:?}"),
        }
    }
}

/// What has no partial results ends too, and says so.
#[test]
fn a_signal_ends_commands_that_have_no_partial_results() {
    let at = folder("nothing_to_keep");
    fs::write(at.join("log.csv"), "time\n").unwrap();
    for arguments in [
        &["analyze", "-", "--json"][..],
        &["check", "-"],
        &["equations", "-"],
        &["design", "-"],
        &["run", "-"],
        &["bench", "-"],
        &["identify", "-", "log.csv"],
    ] {
        // A pipe that nobody writes to: the model is waited for. A signal that comes before it is listened for ends it at once.
        let ends = (1..8).map(|k| {
            let child = Command::new(env!("CARGO_BIN_EXE_kardan"))
                .current_dir(&at)
                .args(arguments)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn();
            let mut child = child.unwrap();
            let open = child.stdin.take();
            sleep(Duration::from_millis(50 << k));
            signal(&child, "-INT");
            let out = ended(child);
            drop(open);
            out
        });
        let out = ends.into_iter().find(|out| out.status.code().is_some()).expect("it listens");
        assert_eq!(out.status.code(), Some(2), "{out:?}");
        assert!(String::from_utf8_lossy(&out.stderr).contains("no partial results"), "{out:?}");
        if arguments.contains(&"--json") {
            let json = printed(&out.stdout);
            assert!(json["error"].to_string().contains("stopped by a signal"), "{json}");
        }
    }
}
