//! The binary as its users meet it: bad inputs, help, lists, closed pipes.

use std::fs;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

use super::schemas::printed;

const BUILTIN: &str = "sia-steering";
const COMMANDS: [&str; 11] = [
    "run",
    "analyze",
    "design",
    "bench",
    "equations",
    "linearise",
    "check",
    "models",
    "elements",
    "schema",
    "completions",
];

fn kardan(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command.current_dir(folder).args(arguments).stdin(Stdio::null());
    command
}

fn output(folder: &Path, arguments: &[&str]) -> Output {
    kardan(folder, arguments).output().unwrap()
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
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

#[test]
fn bad_inputs_are_explained_by_every_command_that_reads_a_model() {
    let at = folder("bad_inputs");
    fs::create_dir(at.join("folder")).unwrap();
    fs::write(at.join("empty.toml"), "").unwrap();
    fs::write(at.join("blank.toml"), " \n\t\r\n").unwrap();
    fs::write(at.join("utf16.toml"), b"\xff\xfea\0=\0").unwrap();
    fs::write(at.join("latin1.toml"), b"a = 1\n# gr\xfc\xdfe\n").unwrap();
    fs::File::create(at.join("large.toml")).unwrap().set_len(1 << 40).unwrap();
    let mut cases: Vec<(&str, &str, &[&str])> = vec![
        ("missing.toml", "file::not-found", &["no file", "missing.toml", BUILTIN]),
        ("sia-sterring.toml", "file::not-found", &["did you mean", BUILTIN]),
        ("no/such/folder.toml", "file::not-found", &["no/such/folder.toml"]),
        ("folder", "file::directory", &["directory"]),
        ("empty.toml", "file::empty", &["empty", "[shaft."]),
        ("blank.toml", "file::empty", &["empty"]),
        ("utf16.toml", "file::utf-16", &["UTF-16", "UTF-8"]),
        ("latin1.toml", "file::not-utf-8", &["0xFC", "offset 10", "line 2"]),
        ("large.toml", "file::too-large", &["16 MiB"]),
        ("-", "file::empty", &["standard input"]),
    ];
    if cfg!(unix) {
        cases.push(("/dev/zero", "file::not-regular", &["a device, not a file", "standard input"]));
        cases.push(("empty.toml/x", "file::unreadable", &["not a directory"]));
    }
    for (model, code, parts) in cases {
        for command in ["run", "analyze", "design", "bench", "equations", "check"] {
            let got = output(&at, &[command, model]);
            let stderr = plain_text(&got.stderr);
            assert_eq!(got.status.code(), Some(2), "{command} {model}: {stderr}");
            assert!(got.stdout.is_empty(), "{command} {model}");
            for part in parts.iter().chain([&code]) {
                assert!(stderr.contains(part), "{command} {model} does not say {part}: {stderr}");
            }
            assert!(!stderr.contains("panicked"));
        }
        for command in ["run", "analyze", "design", "bench"] {
            let got = output(&at, &[command, model, "--json"]);
            assert_eq!(got.status.code(), Some(2));
            let object = printed(&got.stdout);
            let only = &object["error"]["diagnostics"][0];
            assert_eq!(only["code"], code);
            assert_eq!(only["line"], Value::Null);
            assert_eq!(object["error"]["message"], only["message"]);
            assert!(plain_text(&got.stderr).contains(code));
        }
    }
    assert!(!at.join("kardan-out").exists(), "a bad model must leave no folder behind");
}

/// Nothing ever comes out of a pipe that nobody writes to: wherever a file is read, it is refused and not waited for.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let at = folder("pipes");
    assert!(Command::new("mkfifo").arg(at.join("pipe")).status().unwrap().success());
    std::os::unix::net::UnixListener::bind(at.join("socket")).unwrap();
    let shaft = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
    fs::write(at.join("sound.toml"), shaft).unwrap();
    for (path, kind) in [("pipe", "a pipe"), ("socket", "a socket"), ("/dev/zero", "a device"), (".", "a directory")] {
        let table = format!("{shaft}[signal.road]\nkind = \"table\"\nfile = \"{path}\"\n");
        fs::write(at.join("signal.toml"), table).unwrap();
        fs::write(at.join("curve.toml"), format!("{shaft}[table.c]\nfile = \"{path}\"\n")).unwrap();
        for arguments in [
            &["check", path][..],
            &["identify", "sound.toml", path],
            &["check", "signal.toml"],
            &["check", "curve.toml"],
            &["analyze", "--state-space", path],
            &["run", "sound.toml", "--variants-from", path],
        ] {
            let got = output(&at, arguments);
            let stderr = plain_text(&got.stderr);
            assert_eq!(got.status.code(), Some(2), "{arguments:?}: {stderr}");
            assert!(stderr.contains(&format!("{kind}, not a file")), "{arguments:?}: {stderr}");
        }
    }
}

#[test]
fn a_file_called_like_a_builtin_needs_a_dot() {
    let at = folder("shadow");
    fs::write(at.join(BUILTIN), "").unwrap();
    let builtin = output(&at, &["check", BUILTIN]);
    assert!(plain_text(&builtin.stderr).contains(&format!("the file of that name is ./{BUILTIN}")));
    let file = output(&at, &["check", &format!("./{BUILTIN}")]);
    assert_eq!(file.status.code(), Some(2));
    assert!(plain_text(&file.stderr).contains("file::empty"));
}

#[test]
fn an_output_folder_that_cannot_be_used_is_named_before_anything_is_computed() {
    let at = folder("bad_output");
    fs::write(at.join("taken"), "keep").unwrap();
    for (out, part) in [("taken", "is a file"), ("taken/below", "cannot create")] {
        let got = output(&at, &["run", BUILTIN, "--json", "--out", out]);
        assert_eq!(got.status.code(), Some(2));
        let object = printed(&got.stdout);
        let message = object["error"]["message"].as_str().unwrap();
        assert!(message.contains(part) && message.contains(out), "{message}");
        assert_eq!(object["error"]["diagnostics"][0]["code"], "output::folder");
    }
    assert_eq!(fs::read_to_string(at.join("taken")).unwrap(), "keep");
}

#[test]
fn help_of_every_command_has_an_example() {
    let at = folder("help");
    for command in COMMANDS {
        for flag in ["--help", "-h"] {
            let got = output(&at, &[command, flag]);
            assert_eq!(got.status.code(), Some(0));
            let help = text(&got.stdout);
            assert!(help.contains("Example") && help.contains(&format!("kardan {command}")), "{help}");
        }
    }
    assert!(text(&output(&at, &["--help"]).stdout).contains("Example"));
    assert!(text(&output(&at, &["--version"]).stdout).starts_with("kardan "));
}

#[test]
fn wrong_usage_exits_with_2_and_keeps_to_json() {
    let at = folder("usage");
    for arguments in [
        &["run", "--nonsense"][..],
        &["equations"],
        &["models", "--write", "x"],
        &["design", "--inputs", "a"],
        &["fly"],
        &[],
    ] {
        let got = output(&at, arguments);
        assert_eq!(got.status.code(), Some(2), "{arguments:?}");
        assert!(got.stdout.is_empty() && !got.stderr.is_empty());
    }
    let got = output(&at, &["run", "--json", "--format", "xml"]);
    assert_eq!(got.status.code(), Some(2));
    let object = printed(&got.stdout);
    assert!(object["error"]["message"].as_str().unwrap().contains("xml"));
}

#[test]
fn models_are_listed_printed_and_saved_once() {
    let at = folder("models");
    let list = text(&output(&at, &["models"]).stdout);
    assert!(list.lines().any(|line| line.starts_with(BUILTIN)), "{list}");
    // Each mechanism is sketched once, in a few short lines; those that are "the same" have none.
    for model in kardan::model::BUILTIN {
        let sketch = model.sketch();
        assert_eq!(sketch.is_empty(), model.summary.starts_with("the same"), "{}", model.name);
        assert!(sketch.lines().count() <= 8 && sketch.lines().all(|line| line.len() <= 72), "{}", model.name);
        assert!(sketch.lines().all(|line| list.contains(line)), "{list}");
    }
    let printed = output(&at, &["models", BUILTIN]);
    assert!(!printed.stdout.is_empty());
    let saved = output(&at, &["models", BUILTIN, "--write", "my.toml"]);
    assert_eq!(saved.status.code(), Some(0));
    assert_eq!(fs::read(at.join("my.toml")).unwrap(), printed.stdout);
    fs::write(at.join("my.toml"), "mine").unwrap();
    let again = output(&at, &["models", BUILTIN, "--write", "my.toml"]);
    assert_eq!(again.status.code(), Some(2));
    assert!(plain_text(&again.stderr).contains("my.toml"));
    assert_eq!(fs::read_to_string(at.join("my.toml")).unwrap(), "mine");
    let mut names: Vec<_> = fs::read_dir(&at).unwrap().flatten().map(|entry| entry.file_name()).collect();
    names.sort();
    assert_eq!(names, ["kardan.schema.json", "my.toml"], "no temporary file is left");
    let unknown = output(&at, &["models", "sia-sterring"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(plain_text(&unknown.stderr).contains(&format!("did you mean the built-in model `{BUILTIN}`")));
}

#[test]
fn the_manual_has_pages() {
    let at = folder("elements");
    assert!(text(&output(&at, &["elements"]).stdout).contains("shaft"));
    assert!(text(&output(&at, &["elements", "shaft"]).stdout).contains("shaft"));
    let unknown = output(&at, &["elements", "shraft"]);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(plain_text(&unknown.stderr).contains("element::unknown"));
}

#[test]
fn every_shell_gets_its_completions() {
    let at = folder("completions");
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = text(&output(&at, &["completions", shell]).stdout);
        for command in COMMANDS {
            assert!(script.contains(command), "{shell} does not know {command}");
        }
    }
}

#[test]
fn a_closed_pipe_is_no_error() {
    let at = folder("pipe");
    let cases: [&[&str]; 6] =
        [&["models"], &["models", BUILTIN], &["elements"], &["completions", "bash"], &["--help"], &["check", BUILTIN]];
    for arguments in cases {
        let mut child = kardan(&at, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(0), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("panicked") && !stderr.contains("Broken pipe"), "{arguments:?}: {stderr}");
        // Nobody reads what went wrong either.
        let mut child = kardan(&at, arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        drop((child.stdout.take(), child.stderr.take()));
        assert_eq!(child.wait().unwrap().code(), Some(0), "{arguments:?}");
    }
}

#[test]
fn errors_are_shown_with_their_line_and_counted() {
    let at = folder("mistakes");
    fs::write(at.join("bad.toml"), "\u{feff}[shaft.a]\ninertia = \"1 kq m^2\"\n").unwrap();
    for no_color in ["", "1"] {
        let got = kardan(&at, &["check", "bad.toml"]).env("NO_COLOR", no_color).output().unwrap();
        let stderr = text(&got.stderr);
        assert_eq!(got.status.code(), Some(2), "{stderr}");
        assert!(stderr.contains("bad.toml:2:") && stderr.contains("kq m^2"), "{stderr}");
        assert!(
            stderr.lines().last().unwrap().contains("error") && stderr.trim_end().ends_with("in bad.toml"),
            "{stderr}"
        );
        assert!(!stderr.contains('\u{1b}'), "colour without a terminal");
    }
    let got = output(&at, &["run", "bad.toml", "--json"]);
    let object = printed(&got.stdout);
    assert_eq!(object["error"]["diagnostics"][0]["line"], 2);
    assert!(!at.join("kardan-out").exists());
}

#[test]
fn a_model_is_read_from_standard_input() {
    let at = folder("stdin");
    let mut child = kardan(&at, &["check", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let model = output(&at, &["models", BUILTIN]).stdout;
    child.stdin.take().unwrap().write_all(&model).unwrap();
    let got = child.wait_with_output().unwrap();
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    assert!(text(&got.stdout).contains("standard input"));
}

#[test]
fn an_analysis_is_text_json_and_a_page() {
    let at = folder("analyze");
    let shown = output(&at, &["analyze", "two-bodies"]);
    assert_eq!(shown.status.code(), Some(0), "{}", text(&shown.stderr));
    assert!(text(&shown.stdout).starts_with("two-bodies (built-in model two-bodies)\n"));
    assert!(text(&shown.stdout).lines().all(|line| line.chars().count() <= 100));
    assert_eq!(fs::read_dir(&at).unwrap().count(), 0, "no file without --report");

    let got = output(&at, &["analyze", "two-bodies", "--json", "--report", "new/page.html"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    assert!(text(&got.stderr).contains("wrote new/page.html"));
    let object = printed(&got.stdout);
    assert_eq!(object["name"], "two-bodies");
    assert_eq!(object["coordinates"], serde_json::json!(["body_1", "body_2"]));
    for key in ["states", "min_inputs", "min_outputs", "controllable_rank", "observable_rank"] {
        assert!(object[key].is_u64(), "{key}");
    }
    for key in ["controllable", "observable", "minimal"] {
        assert!(object[key].is_boolean(), "{key}");
    }
    assert!(fs::read_to_string(at.join("new/page.html")).unwrap().starts_with("<!doctype html>"));

    let quiet = output(&at, &["analyze", "two-bodies", "--quiet", "--report", "page.html"]);
    assert!(quiet.stderr.is_empty() && at.join("page.html").exists());
}

#[test]
fn a_page_that_cannot_be_written_is_named_before_anything_is_computed() {
    let at = folder("analyze_report");
    fs::create_dir(at.join("folder")).unwrap();
    fs::write(at.join("taken"), "keep").unwrap();
    for (path, code) in [("folder", "output::file"), ("taken/page.html", "output::folder")] {
        for (command, flag) in [("analyze", "--report"), ("design", "--report"), ("design", "--controller")] {
            let got = output(&at, &[command, "two-bodies", "--json", flag, path]);
            assert_eq!(got.status.code(), Some(2), "{command} {flag} {path}");
            let object = printed(&got.stdout);
            assert_eq!(object["error"]["diagnostics"][0]["code"], code);
        }
    }
    assert_eq!(fs::read_to_string(at.join("taken")).unwrap(), "keep");
}

#[test]
fn matrices_are_read_or_refused_kindly() {
    let at = folder("state_space");
    fs::create_dir(at.join("folder")).unwrap();
    fs::write(at.join("empty"), "").unwrap();
    fs::File::create(at.join("large")).unwrap().set_len(1 << 40).unwrap();
    let cases = [
        ("missing", "file::not-found"),
        ("folder", "file::directory"),
        ("empty", "file::empty"),
        ("large", "file::too-large"),
        ("-", "file::empty"),
    ];
    for (path, code) in cases {
        let got = output(&at, &["analyze", "--state-space", path, "--json"]);
        assert_eq!(got.status.code(), Some(2), "{path}");
        let object = printed(&got.stdout);
        assert_eq!(object["error"]["diagnostics"][0]["code"], code, "{path}");
        assert!(
            plain_text(&got.stderr).contains(code) && !plain_text(&got.stderr).contains("built-in model"),
            "{path}"
        );
    }
    // One or the other.
    let both = output(&at, &["analyze", "two-bodies", "--state-space", "x"]);
    assert_eq!(both.status.code(), Some(2));
    assert!(text(&both.stderr).contains("cannot be used with"));
}

#[test]
fn massless_models_are_analysed_and_what_is_eliminated_is_reported() {
    let at = folder("massless");
    let model = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\n[spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\n\
                 stiffness = \"1 N m/rad\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"b\"\n";
    fs::write(at.join("light.toml"), model).unwrap();
    let plain = output(&at, &["analyze", "light.toml", "--json"]);
    let got = output(&at, &["analyze", "light.toml", "--eliminate-massless", "--json"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!(object["elimination"]["removed"], serde_json::json!(["b.w"]));
    assert_eq!(object["state_names"], serde_json::json!(["a.phi", "b.phi", "a.w"]));
    assert_eq!(got.stdout, plain.stdout, "the flag says nothing any more");
    let shown = text(&output(&at, &["analyze", "light.toml"]).stdout);
    assert!(shown.contains("Motions without inertia\n") && shown.contains("of 4 states 3 remain"), "{shown}");
    // In a run the damper makes it a state of first order.
    assert_eq!(output(&at, &["run", "light.toml"]).status.code(), Some(0));
}

/// Names as hostile as a file may have them reach the page and the terminal harmlessly.
#[test]
fn markup_in_names_stays_text() {
    let at = folder("markup");
    let model = "[model]\nname = \"<script>alert('x')</script>\"\ndescription = \"\\\"quoted\\\" & <b>bold</b>\"\n\
                 [shaft.a]\ninertia = \"1 kg m^2\"\n[motor.m]\nshaft = \"a\"\n";
    fs::write(at.join("m.toml"), model).unwrap();
    let got = output(&at, &["analyze", "m.toml", "--report", "m.html"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    let page = fs::read_to_string(at.join("m.html")).unwrap();
    assert!(!page.contains("<script>alert") && !page.contains("<b>bold") && page.contains("&lt;script&gt;alert"));
    fs::write(at.join("m.json"), r#"{"A": [[-1]], "B": [1], "inputs": ["<b>\"u\""], "states": ["it's & <i>"]}"#)
        .unwrap();
    let got = output(&at, &["analyze", "--state-space", "m.json", "--report", "s.html"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    let page = fs::read_to_string(at.join("s.html")).unwrap();
    assert!(!page.contains("<i>\"") && !page.contains("& <i>") && page.contains("it&#39;s &amp; &lt;i&gt;"));
}

/// A device is written to, never replaced.
#[cfg(unix)]
#[test]
fn a_report_may_go_where_no_plain_file_is() {
    let at = folder("special");
    fs::write(at.join("target.html"), "old").unwrap();
    std::os::unix::fs::symlink("target.html", at.join("link.html")).unwrap();
    let got = output(&at, &["analyze", "two-bodies", "--report", "link.html"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    assert!(fs::symlink_metadata(at.join("link.html")).unwrap().is_symlink());
    let page = fs::read_to_string(at.join("target.html")).unwrap();
    assert!(page.starts_with("<!doctype html>") && page.trim_end().ends_with("</html>"));
}

#[test]
fn a_run_says_what_its_inputs_reach() {
    let at = folder("run_structure");
    let got = output(&at, &["run", "two-bodies", "--json"]);
    assert_eq!(got.status.code(), Some(0), "{}", text(&got.stderr));
    let object = printed(&got.stdout);
    assert_eq!((&object["analysis"]["controllable"], &object["analysis"]["states"]), (&true.into(), &4.into()));
    let shown = text(&output(&at, &["run", "two-bodies", "--verbose"]).stdout);
    assert!(shown.contains("structure: controllable by motor_1"), "{shown}");
}

/// Every row of a table has as many cells as its head, and no other file takes the place of the page.
#[test]
fn reports_as_markdown() {
    let at = folder("markdown");
    let whole = |name: &str| {
        let text = fs::read_to_string(at.join(name)).unwrap();
        let bars = |line: &str| line.replace("\\|", "").matches('|').count();
        let mut tables = 0;
        for table in text.split("\n\n").filter(|part| part.trim_start().starts_with('|')) {
            let rows: Vec<usize> = table.trim().lines().map(bars).collect();
            assert!(rows.len() > 2 && rows.iter().all(|row| *row == rows[0]), "{name}: {table}");
            tables += 1;
        }
        assert!(tables > 2, "{name}: {text}");
        text
    };
    assert_eq!(output(&at, &["run", "two-bodies", "--markdown", "--out", "out"]).status.code(), Some(0));
    let page = whole("out/report.md");
    assert!(page.starts_with("# two-bodies\n") && page.contains("## Energy balance"), "{page}");
    for line in page.lines().filter_map(|line| line.strip_prefix("![")) {
        let plot = line.rsplit_once('(').unwrap().1.trim_end_matches(')');
        assert!(at.join("out").join(plot).exists(), "{plot}");
    }
    assert!(!at.join("out/report.html").exists());
    assert_eq!(output(&at, &["analyze", "two-bodies", "--report", "analysis.md"]).status.code(), Some(0));
    assert!(whole("analysis.md").contains("\n## Controllability and observability\n"));
    let arguments = ["design", "harmonic-drive-spring", "--no-simulation", "--report", "design.MD"];
    assert_eq!(output(&at, &arguments).status.code(), Some(0));
    assert!(whole("design.MD").contains("\n## Closed-loop poles\n"));
}

/// Variants that differ in their controllers too are called by their names, whatever parameters they differ in.
#[test]
fn variants_have_the_names_of_the_file() {
    let at = folder("variant_names");
    let model = "[parameters]\nk = \"1.5 N m\"\n[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n\
                 [control.c]\nlaw = \"program\"\ncommands = { m = \"k\" }\n[[variant]]\nname = \"on-soft\"\nset = { k = \"1 N m\" }\n\
                 [[variant]]\nname = \"off\"\nFEWER[[variant]]\nname = \"on-hard\"\nset = { k = \"2 N m\" }\n";
    let (names, values) = (["on-soft", "off", "on-hard"], ["k = 1 N m", "k = 2 N m"]);
    let grid = model.split("[[variant]]").next().unwrap().to_string() + "[variants]\nk = \"[1, 2] N m\"\n";
    // Without names in the file, the parameters tell variants apart.
    for (model, names) in
        [(model.replace("FEWER", "controls = []\n"), &names[..]), (model.replace("FEWER", ""), &names), (grid, &values)]
    {
        fs::write(at.join("m.toml"), model).unwrap();
        let got = output(&at, &["run", "m.toml", "--out", "o", "--no-report", "--verbose"]);
        let rows = text(&got.stdout);
        let energy = rows.split("Energy balance").nth(1).unwrap();
        assert!(names.iter().all(|name| energy.contains(&format!("\n  {name} "))), "{energy}");
    }
}

/// What happens again and again does so at times that a run can follow, as laws do: sensors, blocks, noise, pulses, drivers, by themselves and through parameters.
#[test]
fn absurdly_short_times_are_refused() {
    let at = Path::new(env!("CARGO_TARGET_TMPDIR")).join("short_times");
    fs::create_dir_all(&at).unwrap();
    let sensor = "[sensor.e]\nshaft = \"a\"\nmeasures = \"angle\"\nsample_time = TIME\n";
    let block = "[block.b]\nkind = \"hold\"\ninput = \"a.phi\"\nsample_time = TIME\n";
    let noise = "[signal.n]\nkind = \"noise\"\ndeviation = \"1 N m\"\nhold = TIME\n";
    let pulses = "[signal.p]\nkind = \"pulses\"\nhigh = \"1 N m\"\nwidth = \"0.1 ns\"\nperiod = TIME\n";
    for part in [sensor, block, noise, pulses] {
        for (time, right) in [("\"1 ns\"", false), ("\"0.999 us\"", false), ("\"t0\"", false), ("\"1 us\"", true)] {
            let model = format!(
                "[shaft.a]\ninertia = \"1 kg m^2\"\n[parameters]\nt0 = \"1 ps\"\n{}",
                part.replace("TIME", time)
            );
            fs::write(at.join("m.toml"), model).unwrap();
            let got =
                Command::new(env!("CARGO_BIN_EXE_kardan")).current_dir(&at).args(["check", "m.toml"]).output().unwrap();
            let stderr = String::from_utf8_lossy(&got.stderr).into_owned();
            assert_eq!(!stderr.contains("at least 1 us"), right, "{part} {time}: {stderr}");
        }
    }
}
