//! `kardan safety`: the table as text, page, JSON and comma-separated values, its exit codes, and the commands of its rows.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use super::schemas::printed;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("safety_{name}"));
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn kardan(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null()).output().unwrap()
}

/// A wheel that a motor pushes; it dies, or gives half.
const MODEL: &str = "\
[parameters]
push = \"4 N m\"
[shaft.a]
inertia = \"2 kg m^2\"
[motor.m]
shaft = \"a\"
[scenario]
duration = \"1 s\"
[[scenario.event]]
signal = \"m.tau\"
at = \"0 s\"
to = \"push\"
[fault.dead]
motor = \"m\"
at = \"0.5 s\"
[fault.weak]
motor = \"m\"
kind = \"reduced\"
value = 0.9
at = \"0.5 s\"
[safety]
values = { push = [\"2 N m\", \"4 N m\"] }
[[safety.effect]]
name = \"turn\"
signal = \"a.phi\"
below = \"5 deg\"
";

/// Times in which no row of the results lies are refused: all would be harmless in them, or nothing detected. Rows lie 50 us apart behind a fault.
#[test]
fn times_shorter_than_a_row_are_refused() {
    let at = folder("short");
    for (from, to, reported) in [
        ("below = \"5 deg\"", "below = \"5 deg\"\nwindow = \"1 ns\"", "effect `turn`: its window of 0.000000001 s"),
        ("below = \"5 deg\"", "below = \"5 deg\"\nwindow = \"49 us\"", "write at least 5.000e-5 s"),
        (
            "[safety]",
            "[safety]\ndetected = \"a.w < 0 rad/s\"\ndetection_time_limit = \"1 us\"",
            "`detection_time_limit` of `[safety]` of 0.000001 s",
        ),
    ] {
        fs::write(at.join("m.toml"), MODEL.replace(from, to)).unwrap();
        let got = kardan(&at, &["safety", "m.toml"]);
        let error =
            String::from_utf8_lossy(&got.stderr).replace('│', " ").split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(
            got.status.code() == Some(2) && error.contains("safety::window") && error.contains(reported),
            "{error}"
        );
    }
    // One row is enough, and a finer step has more of them.
    for (window, step) in [("50 us", "1 ms"), ("5 us", "0.1 ms")] {
        let model = MODEL.replace("below = \"5 deg\"", &format!("below = \"5 deg\"\nwindow = \"{window}\""));
        let model = model.replace("[scenario]", &format!("[scenario]\noutput_step = \"{step}\""));
        fs::write(at.join("m.toml"), model).unwrap();
        let got = kardan(&at, &["safety", "m.toml"]);
        assert_ne!(got.status.code(), Some(2), "{}", String::from_utf8_lossy(&got.stderr));
    }
}

#[test]
fn the_table_in_all_its_forms() {
    let at = folder("forms");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["safety", "m.toml", "--report", "r.html", "--csv", "r.csv", "--json"]);
    // A dead motor lacks more than 5 deg at either push.
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    let rows = object["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 6);
    let page = fs::read_to_string(at.join("r.html")).unwrap();
    let table = fs::read_to_string(at.join("r.csv")).unwrap();
    assert_eq!(table.lines().count(), 7, "{table}");
    assert!(table.starts_with(
        "faults,variant,push,begins [s],detected after [s],reaction,turn [rad],worst effect,verdict,note,command\n"
    ));
    for (row, line) in rows.iter().zip(table.lines().skip(1)) {
        let command = row["command"].as_str().unwrap();
        assert!(page.contains(&command.replace('\'', "&#39;")) || page.contains(command), "{command} in the page");
        assert!(line.ends_with(command), "{line}");
        let verdict = row["verdict"].as_str().unwrap();
        assert!(page.contains(verdict) && line.contains(verdict), "{line}");
    }
    // a t²/2 of what is missing: 1 rad/s² or 2 rad/s² for half a second.
    let measured = |row: usize| rows[row]["effects"][0]["measured"].as_f64().unwrap();
    assert!((measured(1) - 0.125).abs() < 1e-12 && (measured(4) - 0.25).abs() < 1e-12);
    assert_eq!(
        (rows[2]["verdict"].as_str(), rows[4]["verdict"].as_str()),
        (Some("harmless"), Some("not detected and harmful"))
    );
    // The command of a row is the run of the row.
    assert_eq!(rows[4]["command"], "kardan run m.toml --set 'push=4 N m' --fault dead");
    let got = kardan(
        &at,
        &["run", "m.toml", "--set", "push=4 N m", "--fault", "dead", "--out", "o", "--runs-only", "--no-report"],
    );
    assert_eq!(got.status.code(), Some(0), "{}", String::from_utf8_lossy(&got.stderr));
    let free = kardan(&at, &["run", "m.toml", "--set", "push=4 N m", "--out", "f", "--runs-only", "--no-report"]);
    assert_eq!(free.status.code(), Some(0));
    let last = |folder: &str| {
        let csv = fs::read_dir(at.join(folder)).unwrap().map(|entry| entry.unwrap().path());
        let path = csv.into_iter().find(|path| path.extension().is_some_and(|kind| kind == "csv")).unwrap();
        let text = fs::read_to_string(path).unwrap();
        let column = text.lines().next().unwrap().split(',').position(|name| name == "a.phi").unwrap();
        text.lines().last().unwrap().split(',').nth(column).unwrap().parse::<f64>().unwrap()
    };
    assert_eq!((last("o") - last("f")).abs(), measured(4));
    let text = kardan(&at, &["safety", "m.toml"]);
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(
        text.contains("2 of 6 rows: 2 not detected and harmful.") && text.contains("dead") && text.contains("weak"),
        "{text}"
    );
}

#[test]
fn what_ends_how() {
    let at = folder("ends");
    fs::write(at.join("good.toml"), MODEL.replace("5 deg", "50 deg")).unwrap();
    assert_eq!(kardan(&at, &["safety", "good.toml"]).status.code(), Some(0));
    fs::write(at.join("none.toml"), MODEL.split("[fault.dead]").next().unwrap()).unwrap();
    let got = kardan(&at, &["safety", "none.toml"]);
    assert_eq!(got.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&got.stderr).contains("no faults to analyse"));
    let got = kardan(&at, &["run", "good.toml", "--fault", "ded"]);
    assert_eq!(got.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&got.stderr).contains("there is no fault `ded`"));
    // Cut short: what was computed by then is there, and how much is missing.
    fs::write(at.join("long.toml"), MODEL.replace("duration = \"1 s\"", "duration = \"1 s\"\noutput_step = \"1 us\""))
        .unwrap();
    let got = kardan(&at, &["safety", "long.toml", "--time-limit", "0.2", "--json"]);
    if got.status.code() == Some(2)
        && !got.stdout.is_empty()
        && !String::from_utf8_lossy(&got.stdout).contains("\"error\"")
    {
        let object = printed(&got.stdout);
        let rows = object["rows"].as_array().unwrap().len() as u64;
        assert_eq!(rows + object["missing"].as_u64().unwrap(), 6);
    }
}
