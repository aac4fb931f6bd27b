//! Every built-in report in a real browser: on a telephone and on a desk, light, dark and on paper, no script fails, nothing is
//! wider than the page, and no chart lacks its title, its unit or its legend.
//!
//! The browser is that of `KARDAN_BROWSER`, else one of Chromium's names in `PATH`. Where there is none the test says so and passes.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

const NAMES: [&str; 5] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome"];
/// Looks at a page and tells its parent what is wrong.
const CHECK: &str = include_str!("check.js");
/// Pages in one start of the browser.
const PAGES_PER_START: usize = 8;
/// One start of the browser takes no longer.
const LIMIT: Duration = Duration::from_secs(90);

/// The reports by their folders, as arguments of the command; each writes `report.html` there. Of the control unit of the steering
/// system one run and one design stand for all.
const REPORTS: [(&str, &[&str]); 31] = [
    ("bench", &["bench", "harmonic-drive-bench", "--study", "--out", "."]),
    ("run-steering-ecu", &["run", "sia-steering-ecu", "--variant", "rack", "--out", "."]),
    (
        "design-steering-ecu",
        &["design", "sia-steering-ecu", "--no-simulation", "--control", "full_state", "--report", PAGE],
    ),
    ("design-spring-ecu", &["design", "harmonic-drive-spring-ecu", "--report", PAGE]),
    ("run-spring-ecu", &["run", "harmonic-drive-spring-ecu", "--out", "."]),
    ("design-ecu", &["design", "harmonic-drive-ecu", "--report", PAGE]),
    ("run-ecu", &["run", "harmonic-drive-ecu", "--set", "scenario.duration=0.1 s", "--out", "."]),
    ("run-steering", &["run", "sia-steering", "--out", "."]),
    ("run-joint", &["run", "sia-joint-angle", "--out", "."]),
    ("run-drive", &["run", "harmonic-drive", "--out", "."]),
    ("run-spring", &["run", "harmonic-drive-spring", "--out", "."]),
    ("run-bodies", &["run", "two-bodies", "--out", "."]),
    ("run-ladder", &["run", "rlc-ladder", "--out", "."]),
    ("run-pinion", &["run", "rack-and-pinion", "--out", "."]),
    ("run-motors", &["run", "two-motor-drive", "--out", "."]),
    ("run-many", &["run", "many.toml", "--out", "."]),
    ("analysis-steering", &["analyze", "sia-steering", "--report", PAGE]),
    ("analysis-joint", &["analyze", "sia-joint-angle", "--report", PAGE]),
    ("analysis-drive", &["analyze", "harmonic-drive", "--report", PAGE]),
    ("analysis-spring", &["analyze", "harmonic-drive-spring", "--report", PAGE]),
    ("analysis-bodies", &["analyze", "two-bodies", "--report", PAGE]),
    ("analysis-ladder", &["analyze", "rlc-ladder", "--report", PAGE]),
    ("analysis-pinion", &["analyze", "rack-and-pinion", "--report", PAGE]),
    ("analysis-motors", &["analyze", "two-motor-drive", "--report", PAGE]),
    ("analysis-steering-ecu", &["analyze", "sia-steering-ecu", "--report", PAGE]),
    ("analysis-many", &["analyze", "many.toml", "--report", PAGE]),
    ("design-steering", &["design", "sia-steering", "--report", PAGE]),
    ("design-joint", &["design", "sia-joint-angle", "--report", PAGE]),
    ("design-drive", &["design", "harmonic-drive", "--report", PAGE]),
    ("design-spring", &["design", "harmonic-drive-spring", "--report", PAGE]),
    ("design-bodies", &["design", "two-bodies", "--law", "lqr", "--report", PAGE]),
];
/// What stands on the logs of the bench.
const IDENTIFIED: (&str, &[&str]) =
    ("identify", &["identify", "harmonic-drive-bench", "../bench/harmonic-drive-bench-1.csv", "--report", PAGE]);
const PAGE: &str = "report.html";

/// The browser, or why there is none.
fn browser() -> Result<PathBuf, String> {
    if let Some(path) = std::env::var_os("KARDAN_BROWSER") {
        let path = PathBuf::from(path);
        return if path.is_file() { Ok(path) } else { Err(format!("KARDAN_BROWSER: there is no {}", path.display())) };
    }
    let folders = std::env::var_os("PATH").unwrap_or_default();
    let places = || std::env::split_paths(&folders).flat_map(|folder| NAMES.map(|name| folder.join(name)));
    places().find(|place| place.is_file()).ok_or_else(|| format!("none of {} is in PATH", NAMES.join(", ")))
}

/// A folder of its own, which goes with the test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = std::env::temp_dir().join(format!("kardan-browser-{}-{name}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        std::fs::create_dir_all(&folder).expect("a temporary folder");
        Self(folder)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// A chain of many shafts with names of eighty letters.
fn many() -> String {
    let name = |k: usize| format!("shaft_{k:02}_{}", "x".repeat(71));
    let mut model = String::from("[model]\nname = \"many\"\n");
    for k in 0..24 {
        let _ = writeln!(model, "[shaft.{}]\ninertia = \"0.01 kg m^2\"\ndamping = \"0.1 N m s/rad\"", name(k));
        if k > 0 {
            let (one, other) = (name(k - 1), name(k));
            let _ = writeln!(
                model,
                "[spring_damper.s{k}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{other}\"\nstiffness = \"10 N m/rad\"\ndamping = \"0.1 N m s/rad\""
            );
        }
    }
    let _ = writeln!(
        model,
        "[motor.drive]\nshaft = \"{}\"\n[scenario]\nduration = \"0.5 s\"\noutput_step = \"10 ms\"",
        name(0)
    );
    model
        + "[[scenario.event]]\nsignal = \"drive.tau\"\nat = \"0.1 s\"\nto = \"1 N m\"\n\
           [[scenario.event]]\nsignal = \"drive.tau\"\nat = \"0.4 s\"\nto = \"0 N m\"\n\
           [[plot]]\nname = \"all\"\ntitle = \"All the time\"\nsignals = [\"drive.tau\"]\n\
           [[plot]]\nname = \"part\"\ntitle = \"A part of it\"\nsignals = [\"drive.tau\"]\nfrom = \"0.05 s\"\nuntil = \"0.2 s\"\n"
}

/// Makes a report and puts the script that checks it into its copy.
fn report(folder: &Path, (name, arguments): (&str, &[&str])) -> PathBuf {
    let own = folder.join(name);
    std::fs::create_dir_all(&own).expect("a folder");
    std::fs::write(own.join("many.toml"), many()).expect("a model");
    let done = Command::new(env!("CARGO_BIN_EXE_kardan")).current_dir(&own).args(arguments).output();
    let done = done.expect("kardan starts");
    assert!(done.status.code().is_some_and(|code| code < 2), "{name}: {}", String::from_utf8_lossy(&done.stderr));
    let page = std::fs::read_to_string(own.join(PAGE)).expect("the report");
    let checked = with_check(&page);
    let place = folder.join(format!("{name}.html"));
    std::fs::write(&place, checked).expect("a copy");
    place
}

/// All reports, on as many threads as there are cores.
fn all_reports(folder: &Path) -> Vec<PathBuf> {
    let next = std::sync::atomic::AtomicUsize::new(0);
    let worker = || -> Vec<PathBuf> {
        let number = || REPORTS.get(next.fetch_add(1, std::sync::atomic::Ordering::Relaxed));
        std::iter::from_fn(number).map(|one| report(folder, *one)).collect()
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from).min(4);
    let mut pages: Vec<PathBuf> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..cores).map(|_| scope.spawn(worker)).collect();
        workers.into_iter().flat_map(|worker| worker.join().expect("the reports")).collect()
    });
    pages.push(report(folder, IDENTIFIED));
    pages
}

fn with_check(page: &str) -> String {
    let (head, tail) = page.split_once("<title>").expect("a title");
    format!("{head}<script>{CHECK}</script>\n<title>{tail}")
}

/// What is wrong in pages, each at the width of a telephone, of a desk, and of a sheet of paper.
fn complaints(browser: &Path, folder: &Path, pages: &[PathBuf]) -> Vec<String> {
    let widths = [(390, "screen"), (1440, "screen"), (718, "print")];
    let mut frames = String::new();
    for page in pages {
        for (width, media) in widths {
            let _ = writeln!(
                frames,
                "<iframe src=\"file://{}#{media}\" style=\"width:{width}px;height:900px;border:0\"></iframe>",
                page.display()
            );
        }
    }
    let all = widths.len() * pages.len();
    let harness = format!(
        "<!doctype html><meta charset=\"utf-8\"><body><pre id=\"said\"></pre>\n<script>\n\
         let heard = 0;\n\
         addEventListener(\"message\", (message) => {{\n\
           const said = document.getElementById(\"said\");\n\
           for (const line of message.data) said.append(\"WRONG \" + line + \"\\n\");\n\
           if (++heard === {all}) said.append(\"ALL SEEN\\n\");\n\
         }});\n</script>\n{frames}</body>"
    );
    let place = folder.join("harness.html");
    std::fs::write(&place, harness).expect("a page of frames");
    let dom = dump(browser, folder, &place);
    let output =
        dom.split_once("<pre id=\"said\">").and_then(|(_, tail)| tail.split_once("</pre>")).map(|(output, _)| output);
    let output = output.unwrap_or_else(|| panic!("the browser said: {dom}"));
    let mut wrong: Vec<String> =
        output.lines().filter_map(|line| line.strip_prefix("WRONG ")).map(String::from).collect();
    if !output.contains("ALL SEEN") {
        wrong.push(format!("not every page was seen: {output}"));
    }
    wrong
}

/// The document after its scripts have run.
fn dump(browser: &Path, folder: &Path, page: &Path) -> String {
    let out = folder.join("dom.html");
    let mut child = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--no-first-run"])
        .args(["--allow-file-access-from-files", "--virtual-time-budget=20000", "--window-size=1500,1000"])
        .arg(format!("--user-data-dir={}", folder.join("profile").display()))
        .arg("--dump-dom")
        .arg(format!("file://{}", page.display()))
        .stdout(std::fs::File::create(&out).expect("a file"))
        .stderr(Stdio::null())
        .spawn()
        .expect("the browser starts");
    let begin = Instant::now();
    while child.try_wait().expect("a process of ours").is_none() {
        if begin.elapsed() > LIMIT {
            let _ = child.kill();
            panic!("the browser was not done with {} within {LIMIT:?}", page.display());
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    std::fs::read_to_string(out).expect("a document")
}

#[test]
fn built_in_reports_are_sound_in_a_browser() {
    let browser = match browser() {
        Ok(browser) => browser,
        Err(why) => {
            // Not captured: who runs the tests is to know.
            let _ = writeln!(
                std::io::stderr(),
                "no browser ({why}): the reports are not looked at; install chromium or set KARDAN_BROWSER"
            );
            return;
        }
    };
    let folder = Folder::new("reports");
    let pages = all_reports(&folder.0);
    let wrong: Vec<String> =
        pages.chunks(PAGES_PER_START).flat_map(|pages| complaints(&browser, &folder.0, pages)).collect();
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

/// Two shafts of which six values are uncertain, in two variants.
const SWEPT: &str = "[shaft.a]\ninertia = \"2 kg m^2 ± 10 %\"\ndamping = \"0.5 N m s/rad ± 40 %\"\n\
                     [shaft.b]\ninertia = \"1 kg m^2 ± 20 %\"\ndamping = \"0.1 N m s/rad ± 50 %\"\n\
                     [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"100 N m/rad ± 20 %\"\n\
                     damping = \"1 N m s/rad ± 30 %\"\n[motor.m]\nshaft = \"a\"\n[scenario]\nduration = \"1 s\"\n\
                     [[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n\
                     [[requirement]]\nsignal = \"a.w\"\nmeasure = \"final\"\nabove = \"1.1 rad/s\"\n\
                     [[requirement]]\nsignal = \"a.phi\"\nmeasure = \"final\"\nbelow = \"36 deg\"\n\
                     [[variant]]\nname = \"one\"\n[[variant]]\nname = \"other\"\n";

#[test]
fn runs_of_a_sweep_can_be_looked_into() {
    let Ok(browser) = browser() else { return };
    let folder = Folder::new("sweep");
    std::fs::write(folder.0.join("m.toml"), SWEPT).expect("a model");
    let done = Command::new(env!("CARGO_BIN_EXE_kardan"))
        .current_dir(&folder.0)
        .args(["sweep", "m.toml", "--samples", "80", "--out", "o"])
        .output();
    let done = done.expect("kardan starts");
    assert_eq!(done.status.code(), Some(1), "{}", String::from_utf8_lossy(&done.stderr));
    let page = std::fs::read_to_string(folder.0.join("o/sweep.html")).expect("the page");
    let place = folder.0.join("sweep.html");
    std::fs::write(&place, with_check(&page)).expect("a copy");
    let wrong = complaints(&browser, &folder.0, std::slice::from_ref(&place));
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
    // The check sees where nothing can be clicked, and where what is dragged chooses nothing.
    let dead =
        page.replace("addEventListener(\"click\"", "addEventListener(\"no-click\"").replace("brushes.set(", "[].at(");
    std::fs::write(&place, with_check(&dead)).expect("a copy");
    let wrong = complaints(&browser, &folder.0, &[place]).join("\n");
    assert!(wrong.contains("again") && wrong.contains("chosen along an axis"), "{wrong}");
}

/// What the check is for: a page with one of each mistake is told of all.
#[test]
fn page_errors_are_reported() {
    let Ok(browser) = browser() else { return };
    let folder = Folder::new("mistakes");
    let page = "<!doctype html><html><head><title>bad</title><style>@media print { p { color: red; } }</style></head><body>\
                <div style=\"width:3000px\" id=\"wide\">wide</div>\
                <figure class=\"analysis\"><div class=\"drawing\"><svg width=\"10\" height=\"10\"></svg></div></figure>\
                <script>nothing.there()</script></body></html>";
    let place = folder.0.join("bad.html");
    std::fs::write(&place, with_check(page)).expect("a page");
    let wrong = complaints(&browser, &folder.0, &[place]).join("\n");
    for expected in ["script error", "wider than the page", "a picture without a title", "a picture without a legend"] {
        assert!(wrong.contains(expected), "{expected:?} is missing in {wrong}");
    }
}
