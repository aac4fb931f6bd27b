//! What a file asks of its plots, and what it gets without asking.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// An arm that a motor turns to two references, each of its own variant.
const MODEL: &str = r#"
[model]
name = "arm"
[parameters]
goal = "90 deg"
[variants]
goal = "[90, 45] deg"
[shaft.arm]
inertia = "0.01 kg m^2"
damping = "0.1 N m s/rad"
[motor.drive]
shaft = "arm"
[control.hold]
law = "position_loop"
input = "drive"
output = "arm.phi"
natural_frequency = "20 rad/s"
damping_ratio = 0.7
reference = "wish"
[scenario]
duration = "1 s"
output_step = "10 ms"
[[scenario.event]]
signal = "wish"
at = "0.1 s"
to = "goal"
[[requirement]]
signal = "arm.phi"
measure = "final"
above = "44.5 deg"
below = "179/2 deg"
variants = ["goal-45deg"]
"#;

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("plots").join(name);
    let _ = fs::remove_dir_all(&path);
    fs::create_dir_all(&path).unwrap();
    path
}

fn run(folder: &Path, plots: &str) -> Output {
    fs::write(folder.join("arm.toml"), format!("{MODEL}{plots}")).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_kardan"));
    command
        .current_dir(folder)
        .args(["run", "arm.toml", "--out", "out", "--verbose"])
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

fn plain_text(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes).replace(['│', '×', '╰', '─', '▶'], " ");
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

fn picture(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join("out").join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn controlled_outputs_are_plotted_first_by_default() {
    let at = folder("default");
    let done = run(&at, "");
    assert_eq!(done.status.code(), Some(0), "{}", plain_text(&done.stderr));
    let shown = picture(&at, "controlled-arm.phi.svg");
    // Each variant has a reference of its own.
    for label in ["wish, goal = 90 deg", "wish, goal = 45 deg", "[rad]"] {
        assert!(shown.contains(label), "{label}: {shown}");
    }
    let page = picture(&at, "report.html");
    let places = ["id=\"plot-controlled-arm.phi\"", "id=\"plot-angles\""].map(|id| page.find(id));
    assert!(places[0].is_some() && places[0] < places[1], "{places:?}");
}

#[test]
fn units_windows_and_signs_are_those_requested() {
    let at = folder("asked");
    let plot = "[[plot]]\nname = \"part\"\ntitle = \"Part\"\nsignals = [\"arm.phi\"]\nreferences = [\"-wish\"]\ndisplay_unit = \"deg\"\n\
                from = \"0.5 s\"\nuntil = \"0.75 s\"\n";
    let done = run(&at, plot);
    let stdout = plain_text(&done.stdout);
    assert_eq!(done.status.code(), Some(0), "{stdout} {}", plain_text(&done.stderr));
    assert!(stdout.contains("arm.phi [deg]"), "{stdout}");
    assert!(stdout.contains("44.5 < final arm.phi < 89.5 deg goal = 45 deg 45 deg passed"), "{stdout}");
    let shown = picture(&at, "part.svg");
    for label in ["angle arm.phi [deg]", "−wish, goal = 90 deg", "0.55", "−50"] {
        assert!(shown.contains(label), "{label}: {shown}");
    }
    assert!(!shown.contains(">0.4"), "before the window nothing is drawn");
    let table = picture(&at, "goal-90deg.csv");
    let last: Vec<&str> = table.lines().last().unwrap().split(',').collect();
    assert!(last.iter().any(|cell| cell.starts_with("1.57")), "tables stay in SI: {last:?}");
}

#[test]
fn plots_that_make_no_sense_are_explained() {
    let at = folder("wrong");
    let cases = [
        ("signals = [\"arm.phi\"]\ndisplay_unit = \"furlong\"", "`furlong` is no unit"),
        ("signals = [\"arm.phi\"]\ndisplay_unit = \"rpm\"", "no such signal is drawn"),
        ("signals = [\"arm.phi\"]\ndisplay_unit = \"\"", "found an empty text"),
        ("signals = [\"arm.phi\"]\nfrom = \"0.7 s\"\nuntil = \"0.6 s\"", "no time is left to draw"),
        ("signals = [\"arm.phi\"]\nfrom = \"2 s\"", "no time is left to draw"),
        ("signals = [\"arm.phi\"]\nreferences = [\"-wich\"]", "did you mean `wish`?"),
        ("signals = [\"leg.phi\"]", "there is no signal `leg.phi`"),
    ];
    for (keys, expected) in cases {
        let done = run(&at, &format!("[[plot]]\nname = \"p\"\ntitle = \"P\"\n{keys}\n"));
        let stderr = plain_text(&done.stderr);
        // A run that ends before is no mistake of the plot alone.
        let code = if keys.contains("2 s") { 0 } else { 2 };
        assert_eq!(done.status.code(), Some(code), "{keys}: {stderr}");
        assert!(stderr.contains(expected) && !stderr.contains("panicked"), "{keys}: {stderr}");
    }
}
