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

pub(super) const MODEL: &str = "\
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
    let bounds = ["above", "below"].map(|key| object["requirements"][0][key].clone());
    assert_eq!(bounds, [2.0.into(), serde_json::Value::Null]);
    let schema = String::from_utf8(kardan(&at, &["schema", "sweep"]).stdout).unwrap();
    assert!(["Upper", "Lower"].iter().all(|side| schema.contains(&format!("{side} bound of the measure, SI."))));
    let files = ["rows-000000.parquet", "rows-000001.parquet", "rows-000002.parquet", "sweep.html", "sweep.json"];
    assert!(files.iter().all(|name| at.join("o").join(name).is_file()));
    let reported = kardan(&at, &["sweep", "m.toml", "--samples", "150"]);
    let text = String::from_utf8(reported.stdout).unwrap();
    assert!(text.contains("1 of 1 requirements fail in some of 150 runs") && text.contains("50 %"), "{text}");
}

/// The page has the runs and the commands that make them again; the terminal has neither.
#[test]
fn the_page_has_the_runs() {
    let at = folder("page");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "150", "--out", "o o", "--set", "scenario.duration=1 s"]);
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let page = fs::read_to_string(at.join("o o/sweep.html")).unwrap();
    let data = page.split("id=\"samples-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!((&data["count"], &data["again"]["block"]), (&150.into(), &64.into()));
    assert_eq!(data["again"]["files"][2], "'o o/rows-000002.parquet'");
    assert_eq!(data["again"]["command"], "kardan run m.toml --set 'scenario.duration=1 s' --variants-from");
    assert_eq!((&data["requirements"][0]["above"], &data["requirements"][0]["column"]), (&2.0.into(), &1.into()));
    assert!(page.contains("All 150 runs, 75 of which fail") && page.contains("href=\"worst.html\""));
    let reported = String::from_utf8(got.stdout).unwrap();
    assert!(!reported.contains("--variants-from") && !reported.contains("samples-data"), "{reported}");
    let full = fs::read_to_string(at.join("o o/worst.html")).unwrap();
    assert!(full.contains("model_sample-"));
}

/// On as many threads as asked for, as the manifest of a shard tells, with the same rows.
#[test]
fn threads_are_limited() {
    let at = folder("threads");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let own = ["sweep", "m.toml", "--samples", "150"];
    let rows = ["0", "1", "3"].map(|threads| {
        // More of them than cores too, and as many as there are by themselves.
        let more = if threads == "0" { vec![] } else { vec!["--threads", threads] };
        let got = kardan(&at, &[&own[..], &["--out", threads], &more].concat());
        assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
        let part = format!("part-{threads}");
        assert_eq!(
            kardan(&at, &[&own[..], &["--shard", "1/2", "--out", &part], &more].concat()).status.code(),
            Some(1)
        );
        let manifest = fs::read(at.join(part).join("shard-1-of-2.json")).unwrap();
        let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
        assert!(threads == "0" || manifest["threads"] == threads.parse::<u64>().unwrap(), "{manifest}");
        [0, 1, 2].map(|block| fs::read(at.join(threads).join(format!("rows-{block:06}.parquet"))).unwrap())
    });
    assert!(rows[0] == rows[1] && rows[1] == rows[2]);
    let help = String::from_utf8(kardan(&at, &["sweep", "--help"]).stdout).unwrap();
    // Lines are as wide as the terminal.
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        help.contains("Threads that run the samples") && help.contains("with `--on` those of each shard"),
        "{help}"
    );
}

/// The command beside a run makes that run again, of the variant alone that it is of.
#[test]
fn the_page_shows_how_a_run_is_made_again() {
    let at = folder("again_page");
    let variants = "[[variant]]\nname = \"weak\"\n[[variant]]\nname = \"strong\"\n";
    fs::write(at.join("m.toml"), format!("{MODEL}{variants}")).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "70", "--out", "o"]);
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let page = fs::read_to_string(at.join("o/sweep.html")).unwrap();
    let data = page.split("id=\"samples-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!(data["again"]["variants"], serde_json::json!(["weak", "strong"]));
    let again = "--variants-from o/rows-000000.parquet --sample 7 --variant weak".split(' ');
    let got = kardan(&at, &["run", "m.toml", "--json"].into_iter().chain(again).collect::<Vec<_>>());
    let object = printed(&got.stdout);
    let runs = object["variants"].as_array().unwrap();
    assert_eq!((runs.len(), runs[0]["name"].as_str()), (1, Some("weak_sample-7")));
}

/// A page of full runs does not outlive its sweep, and where there is none it is told why.
#[test]
fn full_runs_are_those_of_this_sweep() {
    let at = folder("full");
    let sweep = |model: &str, more: &[&str]| {
        fs::write(at.join("m.toml"), model).unwrap();
        let got = kardan(&at, &[&["sweep", "m.toml", "--out", "o", "--force"], more].concat());
        (got.status.code(), fs::read_to_string(at.join("o/sweep.html")).unwrap(), at.join("o/worst.html").is_file())
    };
    let (code, page, full) = sweep(MODEL, &["--samples", "100"]);
    assert!(code == Some(1) && page.contains("href=\"worst.html\"") && full);
    let (bare, _) = MODEL.split_once("[[requirement]]").unwrap();
    let figure = "[[figure]]\nname = \"speed\"\nsignal = \"a.w\"\nmeasure = \"final\"\n";
    let (code, page, full) = sweep(&format!("{bare}{figure}"), &["--samples", "100"]);
    assert!(code == Some(0) && !page.contains("worst.html") && !full);
    assert!(sweep(MODEL, &["--samples", "100"]).2);
    let (code, page, full) = sweep(MODEL, &["--samples", "1000000", "--time-limit", "1"]);
    assert_eq!(code, Some(2));
    assert!(page.contains("no full runs of the worst cases: ") && page.contains("runs are missing") && !full);
}

/// A search has the bounds of what it searches for.
#[test]
fn the_page_of_a_search_has_bounds() {
    let at = folder("searched");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "64", "--worst", "1", "--out", "o"]);
    assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let page = fs::read_to_string(at.join("o/sweep.html")).unwrap();
    let data = page.split("id=\"samples-data\">").nth(1).unwrap().split("</script>").next().unwrap();
    let data: serde_json::Value = serde_json::from_str(data).unwrap();
    assert_eq!((&data["requirements"][0]["above"], &data["up"]), (&2.0.into(), &1.into()));
    assert!(page.contains("the worst that was found") && at.join("o/worst.html").is_file());
}

/// A bit of a measured value is flipped: a merge refuses the file by name, so does a run of its rows, and `--resume` computes it again.
#[test]
fn damaged_rows_are_detected() {
    let at = folder("damaged");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let sweep = |more: &[&str]| kardan(&at, &[&["sweep", "m.toml", "--samples", "64", "--out", "o"], more].concat());
    assert_eq!(sweep(&[]).status.code(), Some(1));
    let path = at.join("o/rows-000000.parquet");
    let whole = fs::read(&path).unwrap();
    // The last value of the final speed, 4 N m s over the inertia, where it stands as it is.
    let (_, rows) = kardan::export::rows_of_any_sweep(whole.clone()).unwrap();
    let speed = rows[63].values.iter().find(|(name, _)| name == "requirement.1.measured").unwrap().1;
    let place = whole.windows(8).position(|bytes| bytes == speed.to_le_bytes()).expect("a value");
    let mut flipped = whole.clone();
    flipped[place + 3] ^= 1;
    fs::write(&path, flipped).unwrap();
    for arguments in
        [&["sweep", "merge", "m.toml", "o"][..], &["run", "m.toml", "--variants-from", "o/rows-000000.parquet"]]
    {
        let got = kardan(&at, arguments);
        let reported = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(got.status.code(), Some(2), "{reported}");
        assert!(reported.contains("damaged or altered") && reported.contains("rows-000000.parquet"), "{reported}");
    }
    assert_eq!(sweep(&["--resume"]).status.code(), Some(1));
    assert_eq!(fs::read(&path).unwrap(), whole);
}

/// A folder is filled by one sweep at a time; the lock of one that was killed is gone with it. Shards fill one together, each once.
#[test]
fn two_sweeps_in_one_folder_are_refused() {
    let at = folder("locked");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let small = ["sweep", "m.toml", "--samples", "70", "--out", "o", "--force"];
    let refused = |arguments: &[&str], reported: &str| {
        let got = kardan(&at, arguments);
        let error = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(got.status.code() == Some(2) && error.contains(reported), "{arguments:?}: {error}");
        assert!(error.contains("wait until it ends, or name another folder"), "{error}");
    };
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(&at).args(["sweep", "m.toml", "--samples", "1000000", "--out", "o"]);
    let mut running = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !at.join("o/rows-000000.parquet").exists() {
        assert!(running.try_wait().unwrap().is_none(), "it has ended");
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    for other in [&small[..], &["sweep", "m.toml", "--samples", "70", "--out", "o", "--on", "local", "--resume"]] {
        refused(other, "another sweep is running in the folder");
    }
    refused(&["sweep", "m.toml", "--shard", "1/2", "--out", "o", "--resume"], "in the folder `o`");
    running.kill().unwrap();
    running.wait().unwrap();
    assert_eq!(kardan(&at, &small).status.code(), Some(1));
    // Another shard runs; the same one does not run twice.
    let lock = |name: &str| {
        let path = at.join("s").join(name);
        fs::OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).unwrap()
    };
    fs::create_dir(at.join("s")).unwrap();
    let (folder, own) = (lock(".kardan-lock"), lock(".kardan-lock-1-of-2"));
    folder.lock_shared().unwrap();
    own.lock().unwrap();
    let shard = |part: &'static str| ["sweep", "m.toml", "--samples", "70", "--out", "s", "--shard", part];
    assert_eq!(kardan(&at, &shard("2/2")).status.code(), Some(1));
    refused(&shard("1/2"), "in the folder `s`");
    refused(&["sweep", "m.toml", "--samples", "70", "--out", "s", "--resume"], "in the folder `s`");
    own.unlock().unwrap();
    assert_eq!(kardan(&at, &shard("1/2")).status.code(), Some(1));
}

/// `--force` removes what kardan has written, and nothing that only has such a name.
#[test]
fn force_leaves_foreign_files() {
    let at = folder("foreign");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    fs::create_dir(at.join("o")).unwrap();
    for name in ["rows-000001.parquet", "rows-000009.parquet", "shard-1-of-2.json"] {
        let own = at.join("o").join(name);
        fs::write(&own, "mine").unwrap();
        let got = kardan(&at, &["sweep", "m.toml", "--samples", "70", "--out", "o", "--force"]);
        let error = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(got.status.code() == Some(2) && error.contains(name) && error.contains("did not write it"), "{error}");
        assert_eq!(fs::read(&own).unwrap(), b"mine");
        fs::remove_file(own).unwrap();
    }
    // Names that kardan never gives are not looked at.
    for name in ["rows-1.parquet", "rows-0000001.parquet", "model-mine.toml"] {
        fs::write(at.join("o").join(name), "mine").unwrap();
    }
    for _ in 0..2 {
        let got = kardan(&at, &["sweep", "m.toml", "--samples", "70", "--out", "o", "--force"]);
        assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    }
    assert_eq!(fs::read(at.join("o/rows-1.parquet")).unwrap(), b"mine");
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
    let modified = fs::metadata(at.join("o/rows-000000.parquet")).unwrap().modified().unwrap();
    let again = sweep(&["--resume"]);
    assert_eq!(printed(&again.stdout), printed(&first.stdout));
    assert_eq!([bytes(0), bytes(1), bytes(2)], before);
    assert_eq!(fs::metadata(at.join("o/rows-000000.parquet")).unwrap().modified().unwrap(), modified);
    for (more, reported) in
        [(&[][..], "already contains rows of a sweep"), (&["--resume", "--seed", "3"], "of another sweep")]
    {
        let got = sweep(more);
        assert_eq!(got.status.code(), Some(2));
        let error = printed(&got.stdout).to_string();
        assert!(error.contains(reported), "{error}");
    }
    // What is damaged is made again, which is told.
    fs::write(at.join("o/rows-000001.parquet"), b"PAR1").unwrap();
    let again = sweep(&["--resume"]);
    assert!(String::from_utf8_lossy(&again.stderr).contains("rows-000001.parquet`: it cannot be read"), "{again:?}");
    assert_eq!((printed(&again.stdout), bytes(1)), (printed(&first.stdout), before[1].clone()));
    assert_eq!(sweep(&["--force", "--seed", "3"]).status.code(), Some(1));
}

/// What is refused tells what is different: values of the model, also of another sweep that was replaced, or what else rows follow from.
#[test]
fn what_differs_is_reported() {
    let at = folder("differs");
    let write = |model: &str| fs::write(at.join("m.toml"), model).unwrap();
    let other = MODEL.replace("10 %", "20 %").replace("above = ", "below = ").replace("\"4 N m\"", "\"5 N m\"");
    let own = ["sweep", "m.toml", "--samples", "70", "--json"];
    let run = |arguments: &[&str]| {
        let got = kardan(&at, arguments);
        (got.status.code(), printed(&got.stdout)["error"].to_string().replace("\\\"", "\""))
    };
    let sweep = |more: &[&str]| run(&[&own[..], more].concat());
    let models = |folder: &str| {
        let names =
            fs::read_dir(at.join(folder)).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.starts_with("model-")).collect::<Vec<_>>()
    };
    write(MODEL);
    assert_eq!(sweep(&["--out", "o"]).0, Some(1));
    assert_eq!(sweep(&["--out", "one", "--shard", "1/2"]).0, Some(1));
    let model_files = models("o");
    assert_eq!((model_files.len(), &models("one")), (1, &model_files));
    assert_eq!(sweep(&["--out", "o", "--resume"]).0, Some(1));
    let changes = "of another sweep: `shaft.a.inertia` \"2 kg m^2 ± 10 %\", here \"2 kg m^2 ± 20 %\"; \
                   `scenario.event[0].to` \"4 N m\", here \"5 N m\"; `requirement[0].above` is not here; and 1 more";
    write(&other);
    let again = ["run", "m.toml", "--json", "--variants-from", "o/rows-000000.parquet", "--sample", "1"];
    for refused in
        [sweep(&["--out", "o", "--resume"]), run(&["sweep", "merge", "m.toml", "one", "--json"]), run(&again)]
    {
        assert!(refused.0 == Some(2) && refused.1.contains(changes), "{}", refused.1);
    }
    // Only what differs is told, whatever stands behind it.
    write(MODEL);
    for (more, reported) in [
        (&["--seed", "3"][..], "of another sweep: seed 0, here seed 3"),
        (&["--tolerance", "1e-7"], "of another sweep: tolerance 1e-7 only here"),
        (
            &["--method", "taylor", "--max-steps", "9"],
            "limit of steps 9 only here; method Automatic, here method Taylor",
        ),
        (&["--worst", "1"], "of another sweep: --worst 1 only here"),
        (
            &["--set", "scenario.event[0].to=3 N m"],
            "of another sweep: `scenario.event[0].to` \"4 N m\", here \"3 N m\"",
        ),
    ] {
        let (code, error) = sweep(&[&["--out", "o", "--resume"], more].concat());
        assert!(code == Some(2) && error.contains(reported), "{more:?}: {error}");
        assert!(!error.contains("70 samples") && !error.contains("kardan 0"), "{error}");
    }
    // Where it is not known what the model was, it has its number.
    fs::remove_file(at.join("o").join(&model_files[0])).unwrap();
    let (_, error) = sweep(&["--out", "o", "--resume", "--set", "scenario.event[0].to=3 N m"]);
    let number = model_files[0].trim_start_matches("model-").trim_end_matches(".toml");
    assert!(error.contains(&format!("another sweep: model {number}, here model ")), "{error}");
    write(&other);
    assert_eq!(sweep(&["--out", "o", "--force"]).0, Some(1));
    assert!(models("o").len() == 1 && models("o") != model_files);
    let on = ["sweep", "m.toml", "--on", "local", "--out", "on", "--shards", "2", "--json"];
    assert_eq!(run(&[&on[..], &["--samples", "70"]].concat()).0, Some(1));
    let (code, error) =
        run(&[&on[..], &["--samples", "80", "--resume", "--set", "scenario.event[0].to=4 N m"]].concat());
    let reported = "of another sweep: `scenario.event[0].to` \"5 N m\", here \"4 N m\"; 70 samples of `model`, here 80 samples of `model`";
    assert!(code == Some(2) && error.contains(reported), "{error}");
}

/// A sweep that is ended keeps its blocks, and says how much is missing.
#[test]
fn an_ended_sweep_keeps_its_blocks() {
    let at = folder("ended");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "1000000", "--time-limit", "2", "--out", "o", "--json"]);
    assert_eq!(got.status.code(), Some(2), "{}", String::from_utf8_lossy(&got.stderr));
    let object = printed(&got.stdout);
    let rows = object["rows"].as_u64().unwrap();
    assert_eq!(rows + object["missing"].as_u64().unwrap(), 1_000_000);
    let warnings = object["warnings"].to_string();
    assert!(warnings.contains("are missing"), "{warnings}");
}

/// A sweep that replaces another one leaves none of its rows, however early it is ended, and goes on without `--force`.
#[test]
fn a_sweep_that_starts_anew_leaves_no_rows_of_another() {
    let at = folder("anew");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let sweep = |seed: &str, more: &[&str]| {
        let own = ["sweep", "m.toml", "--samples", "450", "--out", "o", "--json", "--seed", seed];
        kardan(&at, &[&own, more].concat())
    };
    let rows = || (0..9).filter(|k| at.join(format!("o/rows-{k:06}.parquet")).is_file()).count();
    assert_eq!(sweep("1", &[]).status.code(), Some(1));
    assert_eq!(rows(), 8);
    // Before the first block is there nothing is lost.
    let ended = sweep("2", &["--force", "--time-limit", "1e-9"]);
    let object = printed(&ended.stdout);
    assert!(ended.status.code() == Some(2) && rows() == 8, "{object}");
    assert!(object["notes"].to_string().contains("`o` contains the earlier sweep"), "{object}");
    // Behind it the rows are of one sweep, which goes on.
    if cfg!(debug_assertions) {
        let own = ["sweep", "m.toml", "--samples", "450", "--out", "o", "--seed", "2", "--force"];
        let fault_number = (1..60).find(|number| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
            command.current_dir(&at).args(own).stdin(Stdio::null()).env("KARDAN_FAULT", format!("fail:{number}"));
            assert_eq!(command.output().unwrap().status.code(), Some(2));
            rows() == 1
        });
        assert!(fault_number.is_some(), "{} files", rows());
        let whole = sweep("2", &["--resume"]);
        assert_eq!((whole.status.code(), rows()), (Some(1), 8), "{}", String::from_utf8_lossy(&whole.stderr));
    }
    // A shard without a row leaves what is there.
    assert_eq!(sweep("2", &["--shard", "1/2", "--force", "--time-limit", "1e-9"]).status.code(), Some(2));
    assert_eq!(rows(), 8);
}

/// Rows that ended by a limit of steps are of another sweep than those without it: they are neither gone on with nor merged with others.
#[test]
fn a_limit_of_steps_is_part_of_a_sweep() {
    let at = folder("steps");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let sweep = |more: &[&str]| kardan(&at, &[&["sweep", "m.toml", "--samples", "130", "--json"], more].concat());
    let limited = ["--max-steps", "1"];
    assert_eq!(sweep(&["--shard", "1/2", "--out", "one"]).status.code(), Some(1));
    let got = sweep(&[&["--shard", "2/2", "--out", "two"], &limited[..]].concat());
    assert!(got.status.code() == Some(1), "{}", String::from_utf8_lossy(&got.stderr));
    let resumed = sweep(&["--shard", "2/2", "--out", "two", "--resume"]);
    let merged = kardan(&at, &["sweep", "merge", "m.toml", "one", "two", "--json"]);
    for got in [resumed, merged] {
        let object = printed(&got.stdout).to_string();
        assert!(got.status.code() == Some(2) && object.contains("limit of steps 1"), "{object}");
    }
    let again = sweep(&[&["--shard", "2/2", "--out", "two", "--resume"], &limited[..]].concat());
    assert_eq!(again.status.code(), Some(1), "{}", String::from_utf8_lossy(&again.stderr));
    let merged = kardan(&at, &[&["sweep", "merge", "m.toml", "two", "--json"], &limited[..]].concat());
    assert!(printed(&merged.stdout)["missing"] == 64, "{}", String::from_utf8_lossy(&merged.stdout));
}

/// Shards put together are the whole, bit by bit; what is missing is told, what is of another sweep refused.
#[test]
fn shards_are_the_whole() {
    let at = folder("shards");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    let sweep = |more: &[&str]| kardan(&at, &[&["sweep", "m.toml", "--samples", "450", "--seed", "3"], more].concat());
    let whole = sweep(&["--out", "whole"]);
    assert_eq!(whole.status.code(), Some(1));
    for of in [1, 3, 9] {
        let parts: Vec<String> = (1..=of).map(|k| format!("part-{k}-of-{of}")).collect();
        for (k, part) in parts.iter().enumerate() {
            let got = sweep(&["--shard", &format!("{}/{of}", k + 1), "--out", part]);
            assert!(got.status.code() != Some(2), "{}", String::from_utf8_lossy(&got.stderr));
            let manifest = fs::read(at.join(part).join(format!("shard-{}-of-{of}.json", k + 1))).unwrap();
            let manifest: serde_json::Value = serde_json::from_slice(&manifest).unwrap();
            assert_eq!(
                (manifest["shard"].as_u64(), manifest["rows"].clone()),
                (Some(k as u64 + 1), manifest["samples"].clone())
            );
        }
        let names: Vec<&str> = parts.iter().map(String::as_str).collect();
        let merge = |parts: &[&str], more: &[&str]| kardan(&at, &[&["sweep", "merge", "m.toml"], parts, more].concat());
        let got = merge(&names, &["--out", "all"]);
        assert_eq!(got.status.code(), Some(1), "{}", String::from_utf8_lossy(&got.stderr));
        assert_eq!(fs::read(at.join("all/sweep.json")).unwrap(), fs::read(at.join("whole/sweep.json")).unwrap());
        // The full runs of the worst cases too.
        assert_eq!(fs::read(at.join("all/worst.html")).unwrap(), fs::read(at.join("whole/worst.html")).unwrap());
        assert!(fs::read_to_string(at.join("all/sweep.html")).unwrap().contains("href=\"worst.html\""));
        // A block that is there twice counts once.
        let repeated = merge(&[&names[..], &["whole"]].concat(), &["--json"]);
        assert_eq!(repeated.stdout, fs::read(at.join("whole/sweep.json")).unwrap());
        if of == 3 {
            fs::create_dir(at.join("not begun")).unwrap();
            let got = merge(&[names[0], names[1], "not begun"], &["--json"]);
            let object = printed(&got.stdout);
            assert_eq!((got.status.code(), object["missing"].as_u64()), (Some(2), Some(450 - 320)), "{object}");
            assert!(object["notes"].to_string().contains("between samples 320 and 449"), "{object}");
            assert!(object["notes"].to_string().contains("with `--resume`: 3/3."), "{object}");
            assert!(object["notes"].to_string().contains("There are no rows in `not begun`"), "{object}");
        }
    }
    // A file whose number no block has.
    fs::copy(at.join("whole/rows-000000.parquet"), at.join(format!("all/rows-{}.parquet", u64::MAX))).unwrap();
    let got = kardan(&at, &["sweep", "merge", "m.toml", "whole", "all", "--json"]);
    assert!(got.status.code() == Some(2) && printed(&got.stdout).to_string().contains("all rows of its block"));
    fs::write(at.join("m.toml"), MODEL.replace("10 %", "20 %")).unwrap();
    let got = kardan(&at, &["sweep", "merge", "m.toml", "whole", "--json"]);
    assert!(got.status.code() == Some(2) && printed(&got.stdout).to_string().contains("of another sweep"));
}

/// Rows of a sweep run again are what they were, to the last bit, with a law that was designed on the values of the file.
#[test]
fn rows_run_again_are_the_same() {
    let at = folder("again");
    let law = "[control.hold]\nlaw = \"position_loop\"\noutput = \"a.phi\"\ninput = \"m\"\nreference = \"target\"\ndamping_ratio = 0.7\n\
               natural_frequency = \"3 rad/s\"\n";
    let model = MODEL.replace("signal = \"m.tau\"", "signal = \"target\"").replace("4 N m", "1 rad") + law;
    fs::write(at.join("m.toml"), &model).unwrap();
    let got = kardan(&at, &["sweep", "m.toml", "--samples", "70", "--out", "o", "--json"]);
    if got.status.code() == Some(2) {
        panic!("{}", String::from_utf8_lossy(&got.stderr));
    }
    let swept = |name: &str, sample: u64| {
        let rows = fs::read(at.join("o/rows-000000.parquet")).unwrap();
        let (_, rows) = kardan::export::rows_of_any_sweep(rows).unwrap();
        let row = rows.iter().find(|row| row.sample == sample).unwrap();
        row.values.iter().find(|(other, _)| other == name).unwrap().1
    };
    let again = |more: &[&str]| {
        let run = ["run", "m.toml", "--variants-from", "o/rows-000000.parquet", "--runs-only", "--no-report", "--json"];
        kardan(&at, &[&run, more].concat())
    };
    let got = again(&["--sample", "5,63"]);
    let object = printed(&got.stdout);
    for (k, sample) in [5, 63].into_iter().enumerate() {
        let run = &object["variants"][k];
        assert_eq!(run["name"], format!("model_sample-{sample}"));
        let measured = run["requirements"][0]["measured"].as_f64().unwrap();
        assert_eq!(measured.to_bits(), swept("requirement.1.measured", sample).to_bits());
    }
    for (more, reported) in [
        (&["--sample", "64"][..], "has no sample 64"),
        (&["--sample", "5", "--set", "a.inertia=3 kg m^2"], "of another sweep"),
        (&["--sample", "5", "--tolerance", "1e-6"], "other integration settings"),
    ] {
        let got = again(more);
        assert!(got.status.code() == Some(2) && printed(&got.stdout).to_string().contains(reported), "{more:?}");
    }
}

#[test]
fn nonsense_is_refused() {
    let at = folder("nonsense");
    fs::write(at.join("m.toml"), MODEL).unwrap();
    fs::write(at.join("same.toml"), MODEL.replace(" ± 10 %", "")).unwrap();
    for (name, points, count) in [("c", "corners\"", 70), ("g", "grid\"", 12), ("l", "grid\"\nlevels = 20000000", 1)] {
        let shafts = (0..count).map(|k| format!("[shaft.a{k}]\ninertia = \"2 kg m^2 ± 10 %\"\n")).collect::<String>();
        let model = format!("[sweep]\npoints = \"{points}\n{shafts}[scenario]\n");
        fs::write(at.join(format!("{name}.toml")), model).unwrap();
    }
    for (arguments, reported) in [
        (&["sweep", "same.toml"][..], "no value of the file varies"),
        (
            &["sweep", "m.toml", "--samples", "0"],
            "invalid value '0' for '--samples <N>': a sweep has at least one sample; write a number such as 1000",
        ),
        (
            &["sweep", "m.toml", "--samples", "1e3"],
            "'1e3' for '--samples <N>': samples are counted by a whole number; write it in digits only, such as 1000",
        ),
        (&["sweep", "m.toml", "--samples", "10k"], "write it in digits only, such as 1000"),
        (&["sweep", "m.toml", "--samples", "-5"], "write it in digits only, such as 1000"),
        (
            &["sweep", "m.toml", "--seed", "-1"],
            "'-1' for '--seed <S>': a seed is a whole number from 0 to 18446744073709551615; write it in digits",
        ),
        (
            &["sweep", "c.toml"],
            "with 2 levels of 70 parameters has more than 18446744073709551615 samples: the limit is 10000000 help: vary fewer",
        ),
        (
            &["sweep", "g.toml"],
            "with 5 levels of 12 parameters has 244140625 samples: the limit is 10000000 help: write `points = \"grid\"` with `levels = 3`, which has 531441, vary fewer",
        ),
        (
            &["sweep", "l.toml"],
            "with 20000000 levels of 1 parameters has 20000000 samples: the limit is 10000000 help: write `points = \"grid\"` with `levels = 10000000`",
        ),
        (&["sweep", "m.toml", "--samples", "20000000"], "20000000 samples"),
        (&["sweep", "m.toml", "--variant", "nobody"], "there is no variant `nobody`"),
        (&["sweep", "m.toml", "--resume"], "--out"),
        (&["sweep", "m.toml", "--shard", "4/3", "--out", "o"], "there is no part 4 of 3"),
        (&["sweep", "m.toml", "--shard", "0/3", "--out", "o"], "there is no part 0 of 3"),
        (&["sweep", "m.toml", "--shard", "1/3"], "--out"),
        (&["sweep", "merge", "m.toml", "nowhere"], "there is no folder `nowhere`"),
        (&["sweep", "merge", "m.toml", "."], "there are no rows in `.`"),
        (&["sweep", "m.toml", "--watch", "--out", "o"], "add `--force`"),
        (&["sweep", "m.toml", "--watch", "--out", "o", "--resume"], "add `--force`"),
        (&["run", "m.toml", "--variants-from", "m.toml"], "cannot be read"),
        (&["sweep", "m.toml", "--out", "m.toml"], "exists already and is a file"),
    ] {
        let got = kardan(&at, arguments);
        let error = String::from_utf8_lossy(&got.stderr).replace(['\n', '│'], " ");
        let error = error.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(got.status.code() == Some(2) && error.contains(reported), "{arguments:?}: {error}");
    }
}

/// A figure of two normal numbers, bounded beyond what most samples reach.
const FAR: &str = "\
[parameters]
x = 0
y = 0
[shaft.s]
inertia = \"1 kg m^2\"
[motor.m]
shaft = \"s\"
[scenario]
duration = \"0.01 s\"
initial = { \"s.w\" = \"1 rad/s\" }
[[figure]]
name = \"f\"
value = \"0.6*x + 0.8*y\"
[[requirement]]
figure = \"f\"
below = 3
[[requirement]]
signal = \"t\"
measure = \"events\"
below = 5
[[sweep.vary]]
parameter = \"x\"
distribution = \"normal\"
deviation = 1
[[sweep.vary]]
parameter = \"y\"
distribution = \"normal\"
deviation = 1
";

/// Searches, rare failures and samples until they are enough are told, write rows, go on, and a row runs again.
#[test]
fn goals_are_reported_and_go_on() {
    let at = folder("goals");
    fs::write(at.join("m.toml"), FAR).unwrap();
    let goals = [
        (&["--samples", "160", "--worst", "1"][..], "worst", "that 160 runs found: margin", 1),
        (&["--samples", "200", "--rare", "f"][..], "rare", "fails with the probability", 1),
        (&["--samples", "400", "--until", "0.05", "--seed", "2"][..], "stopping_rule", "Every requirement is met", 0),
    ];
    for (more, key, reported, code) in goals {
        let sweep = |extra: &[&str]| kardan(&at, &[&["sweep", "m.toml", "--out", key], more, extra].concat());
        let first = sweep(&["--json"]);
        assert_eq!(first.status.code(), Some(code), "{}", String::from_utf8_lossy(&first.stderr));
        let object = printed(&first.stdout);
        assert!(object[key].is_object() && object["missing"] == 0, "{object}");
        let page = fs::read_to_string(at.join(key).join("sweep.html")).unwrap();
        assert!(page.contains(reported), "{reported}");
        let rows: Vec<PathBuf> =
            (0..99).map(|k| at.join(key).join(format!("rows-{k:06}.parquet"))).filter(|path| path.is_file()).collect();
        let bytes: Vec<Vec<u8>> = rows.iter().map(|path| fs::read(path).unwrap()).collect();
        rows[rows.len() / 2..].iter().for_each(|path| fs::remove_file(path).unwrap());
        assert_eq!(printed(&sweep(&["--json", "--resume"]).stdout), object);
        assert!(rows.iter().zip(&bytes).all(|(path, bytes)| fs::read(path).unwrap() == *bytes));
        let text = String::from_utf8(sweep(&["--force"]).stdout).unwrap();
        assert!(text.contains(reported), "{text}");
    }
    let worst = printed(&kardan(&at, &["sweep", "m.toml", "--samples", "160", "--worst", "1", "--json"]).stdout);
    let (sample, block) = (worst["worst"]["sample"].as_u64().unwrap(), worst["worst"]["sample"].as_u64().unwrap() / 10);
    let rows = format!("worst/rows-{block:06}.parquet");
    let got = kardan(
        &at,
        &["run", "m.toml", "--variants-from", &rows, "--sample", &sample.to_string(), "--no-report", "--json"],
    );
    assert_eq!(
        printed(&got.stdout)["variants"][0]["requirements"][0]["measured"],
        worst["worst"]["measured"],
        "{worst}"
    );
}

/// Contradictory options, requirements that are none, and those without a way down.
#[test]
fn goals_that_are_none_are_refused() {
    let at = folder("no_goals");
    fs::write(at.join("m.toml"), FAR).unwrap();
    for (more, reported) in [
        (&["--worst", "1", "--rare", "1"][..], "cannot be used with"),
        (&["--worst", "1", "--until", "0.1"], "cannot be used with"),
        (&["--rare", "1", "--shard", "1/2", "--out", "o"], "cannot be used with"),
        (&["--until", "0.1", "--shard", "1/2", "--out", "o"], "cannot be used with"),
        (&["--until", "half"], "invalid value"),
        (&["--until=-1"], "between 1e-5 and 0.5"),
        (&["--worst", "3"], "there is no requirement `3`"),
        (&["--worst", "max"], "there is no requirement `max`"),
        (&["--worst", "2"], "has no magnitude"),
        (&["--rare", "1", "--samples", "10"], "fewer than 200"),
    ] {
        let got = kardan(&at, &[&["sweep", "m.toml"], more].concat());
        let error = String::from_utf8_lossy(&got.stderr).split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(got.status.code(), Some(2), "{error}");
        assert!(error.contains(reported), "{error}");
    }
}
