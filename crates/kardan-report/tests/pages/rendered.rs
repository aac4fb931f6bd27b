//! The report of a hostile study: several variants, one of them failed, names that are markup, values that are NaN.

use kardan::results::*;
use kardan_report::{Page, plots};

use super::examples as example;

const HOSTILE: &str = "<script>alert('x')</script> & \"$\\frac{1}{2}$\"\u{1}";

fn run(name: &str, beta: &str, end: f64) -> Run {
    let time: Vec<f64> = (0..5000).map(|index| end * index as f64 / 4999.0).collect();
    let signal = |name: &str, physical, value: &dyn Fn(f64) -> f64| Signal {
        name: name.into(),
        physical,
        description: HOSTILE.into(),
        values: time.iter().map(|&t| value(t)).collect(),
    };
    let signals = vec![
        signal("rk.phi", Physical::Angle, &|t| if t > 1.0 && t < 1.2 { f64::NAN } else { t.sin() }),
        signal("m.tau", Physical::Torque, &|t| 1e-5 * t.cos()),
        signal("ref_rk", Physical::Angle, &|t| t.floor()),
    ];
    let text = format!("beta = {beta}");
    Run {
        name: name.into(),
        parameters: vec![ParameterValue { name: "beta".into(), value: 0.1, unit: "rad".into(), text: beta.into() }],
        series: Series { time, signals },
        energy: Energy { input: 2.0, stored: 0.5, dissipated: 1.5, residual: 1e-9, exchanged: 2.0 },
        events: (0..1000)
            .map(|index| Event { time: index as f64 * 1e-3, description: format!("ref_rk steps to {HOSTILE}") })
            .collect(),
        outcome: Outcome::Completed,
        requirements: vec![RequirementResult {
            text: HOSTILE.into(),
            measured: None,
            unit: "rad".into(),
            display: None,
            passed: false,
        }],
        figures: vec![FigureResult {
            name: HOSTILE.into(),
            text: HOSTILE.into(),
            value: Some(0.25),
            unit: "rad".into(),
            display: None,
        }],
        notes: vec!["the split is not unique".into(), text],
        warnings: Vec::new(),
        motor_loads: vec![MotorLoad {
            motor: HOSTILE.into(),
            unit: "N m",
            torque_limit: Some(1.3),
            demand: 24.5,
            at_torque_limit: vec![Span { start: 0.25, end: 0.75 }],
            ..MotorLoad::default()
        }],
        effort: Effort { steps: 4321, rejected: 12, evaluations: 56_789, events: 7, ..Effort::default() },
        accuracy: None,
    }
}

fn hostile() -> Study {
    let mut failed = run("beta-30deg", "30 deg", 3.0);
    failed.outcome = Outcome::Failed { time: 3.0, cause: format!("step size below 1e-14: {HOSTILE}") };
    let matrix = NamedMatrix {
        title: HOSTILE.into(),
        unit: "kg m^2".into(),
        rows: vec!["rk".into()],
        columns: vec![HOSTILE.into()],
        values: vec![vec![f64::NAN]],
    };
    let plot = |id: &str, signals: &[&str]| Plot {
        id: id.into(),
        title: HOSTILE.into(),
        caption: HOSTILE.into(),
        signals: signals.iter().map(|&name| name.into()).collect(),
        references: vec!["ref_rk".into()],
        ..Plot::default()
    };
    Study {
        spectra: Vec::new(),
        model: ModelSummary {
            signals: Vec::new(),
            mechanism: Default::default(),
            name: HOSTILE.into(),
            description: HOSTILE.into(),
            elements: vec![ElementSummary {
                kind: "shaft".into(),
                name: HOSTILE.into(),
                values: "J = 1 kg m^2".into(),
            }],
            coordinates: vec![HOSTILE.into()],
            matrices: vec![matrix.clone()],
            laws: vec![LawSummary {
                name: HOSTILE.into(),
                law: "computed-torque".into(),
                gains: vec![matrix],
                notes: vec![HOSTILE.into()],
            }],
            closed_loop_poles: vec![Complex::new(-3.0, 4.0), Complex::new(-3.0, -4.0), Complex::default()],
        },
        runs: vec![run("beta-0deg", "0 deg", 9.0), run(HOSTILE, "10 deg", 9.0), failed],
        named: false,
        plots: vec![
            plot("rack-angle", &["rk.phi"]),
            plot("mixed", &["rk.phi", "m.tau"]),
            plot("../missing <b>", &["nowhere"]),
        ],
        warnings: vec![HOSTILE.into()],
        analysis: None,
        designs: Vec::new(),
    }
}

/// The page of a study.
fn html(study: &Study) -> String {
    kardan_report::study(study).html()
}

/// The text between the tags, and a panic where tags do not nest or an attribute is not quoted. Enough XML for what
/// `kuva` writes and enough HTML for what the page writes: contents of `<script>` and `<style>` are skipped.
fn texts(markup: &str) -> String {
    const VOID: [&str; 3] = ["meta", "link", "br"];
    let mut open: Vec<&str> = Vec::new();
    let mut texts = String::new();
    let mut remaining = markup.strip_prefix("<!doctype html>").unwrap_or(markup);
    while let Some(start) = remaining.find('<') {
        texts += &remaining[..start];
        assert!(!remaining[..start].contains('>'), "a bare > in {:?}", &remaining[..start]);
        if remaining[start..].starts_with("<!--") {
            remaining = remaining.split_once("-->").expect("the comment ends").1;
            continue;
        }
        let end = tag_end(&remaining[start..]) + start;
        let tag = &remaining[start + 1..end];
        remaining = &remaining[end + 1..];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "unbalanced </{name}>");
            continue;
        }
        let name = tag.split([' ', '/', '\n']).next().unwrap();
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric()) && !name.is_empty(), "tag {tag:?}");
        if tag.ends_with('/') || VOID.contains(&name) {
            continue;
        }
        open.push(name);
        if ["script", "style"].contains(&name) {
            remaining = &remaining[remaining.find(&format!("</{name}>")).expect("it is closed")..];
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    texts + remaining
}

/// Position of the `>` that ends the tag at the start of the text.
fn tag_end(text: &str) -> usize {
    let mut quoted = false;
    for (index, byte) in text.bytes().enumerate() {
        match byte {
            b'"' => quoted = !quoted,
            b'>' if !quoted => return index,
            b'<' if index > 0 => panic!("< inside a tag: {:?}", &text[..index]),
            _ => {}
        }
    }
    panic!("a tag does not end: {:?}", &text[..text.len().min(80)]);
}

#[test]
fn the_pictures_are_well_formed_and_name_what_they_show() {
    let files = plots(&hostile());
    let names: Vec<&str> = files.iter().map(|file| file.name.as_str()).collect();
    assert_eq!(names, ["rack-angle.svg", "mixed.svg", "-missing--b-.svg"]);
    for file in &files {
        let shown = texts(&file.svg);
        assert!(shown.contains("&lt;script&gt;") && shown.contains("$\\frac{1}{2}$"), "the title as it is: {shown}");
        assert!(!file.svg.contains("<script") && !file.svg.contains("NaN") && !file.svg.contains("inf"));
        assert_eq!(file.svg.matches("://").count(), 1, "the namespace only");
        assert!(!file.svg.contains('\u{1}'), "XML knows no control characters");
    }
    let angle = texts(&files[0].svg);
    for label in ["beta = 0 deg", "beta = 10 deg", "beta = 30 deg", "ref_rk", "angle rk.phi [rad]", "time [s]"] {
        assert!(angle.contains(label), "{label} is missing");
    }
    let mixed = texts(&files[1].svg);
    assert!(mixed.contains("m.tau, beta = 30 deg") && mixed.contains("angle [rad], torque [N m]"));
    assert!(texts(&files[2].svg).contains("ref_rk"), "the reference is there even if the signal is not");
    for (width, expected) in [("2.9", 2), ("1.5", 4)] {
        let pieces = files[0].svg.matches(&format!("stroke-width=\"{width}\"")).count();
        assert_eq!(
            pieces, expected,
            "the gap splits each of the three curves; of the two that coincide the lower one is wider"
        );
    }
    assert!(angle.contains("beta = 10 deg (same as beta = 0 deg)"), "the legend says so: {angle}");
    assert_eq!(files[0].svg.matches("stroke-dasharray=\"6 4\"").count(), 1, "one reference, drawn once");
}

#[test]
fn the_page_is_one_well_formed_file_that_fetches_nothing() {
    let page = html(&hostile());
    texts(&page);
    for forbidden in ["http:", "https:", "://", "src=", "@import", "<script>alert", "\u{1}"] {
        assert!(!page.contains(forbidden), "{forbidden:?} in the page");
    }
    assert_eq!(page.matches("url(").count(), page.matches("url(#clip-").count(), "only clip paths of its own");
    assert_eq!(page, html(&hostile()), "the same study, the same bytes");
    assert_eq!(page.matches("</script>").count(), 4, "no text of the study closes a script");
}

#[test]
fn the_page_shows_every_plot_variant_and_section() {
    let study = hostile();
    let page = html(&study);
    for id in ["plot-rack-angle", "plot-mixed", "plot--missing--b-"] {
        assert!(page.contains(&format!("id=\"{id}\"")), "{id}");
    }
    for section in [
        "plots",
        "figures",
        "measured",
        "requirements",
        "motors",
        "energy",
        "events",
        "notes",
        "warnings",
        "model",
        "variants",
    ] {
        assert!(page.contains(&format!("<section id=\"{section}\">")), "{section}");
        assert!(page.contains(&format!("href=\"#{section}\"")), "{section} is not in the contents");
    }
    for text in [
        "beta = 0 deg",
        "beta = 10 deg",
        "beta = 30 deg",
        "beta-30deg",
        "stopped at 3 s",
        "step size below 1e-14",
        "2 of 3 variants completed, 1 failed",
        "0 of 3 requirements are met",
        "not measured",
        "24.5",
        "0.5 s of 3 s",
        "all variants",
        "700 later ones",
        "56789",
        "−3 ± 4 j",
        "5.0e−10",
    ] {
        assert!(page.contains(text), "{text:?} is missing");
    }
}

#[test]
fn the_data_are_valid_json_with_null_for_nan() {
    let data = kardan_report::study(&hostile()).data.unwrap();
    assert!(data.contains("null,null") && !data.contains("NaN") && !data.contains('<'));
    assert!(data.starts_with("{\"marks\":[0,1e-3,"), "{}", &data[..60]);
    // Balanced outside of strings, and as many numbers as times.
    let curve = data.split("\"t\":[").nth(1).unwrap();
    let (times, tail) = curve.split_once("],\"v\":[").unwrap();
    let values = tail.split(']').next().unwrap();
    assert_eq!(times.split(',').count(), values.split(',').count());
    assert!(times.split(',').all(|time| time.parse::<f64>().is_ok()));
    assert!(values.split(',').all(|value| value == "null" || value.parse::<f64>().is_ok()));
}

#[test]
fn warnings_about_a_run_come_first() {
    let doubted = Run { warnings: vec!["the energy balance does not close".into()], ..run("one", "0 deg", 1.0) };
    let study = Study { runs: vec![doubted, run("two", "1 deg", 1.0)], ..Study::default() };
    let page = kardan_report::study(&study);
    assert!(page.html().contains("the numbers of 1 of 2 variants are doubtful"));
    let terminal = page.text("model.toml");
    let place = |text: &str| terminal.find(text).unwrap_or_else(|| panic!("{text:?} is missing in {terminal}"));
    assert!(place("does not close") < place("Energy balance"));
    assert!(terminal.contains("WARNING: beta = 0 deg: the energy balance does not close."), "{terminal}");
}

#[test]
fn one_requirement_is_met_or_is_not() {
    let judged = |all: &[bool]| {
        let one = run("one", "0 deg", 1.0);
        let requirement = |passed: &bool| RequirementResult { passed: *passed, ..one.requirements[0].clone() };
        let study = Study {
            runs: vec![Run { requirements: all.iter().map(requirement).collect(), ..one.clone() }],
            ..Study::default()
        };
        kardan_report::study(&study).text("model.toml")
    };
    assert!(judged(&[true, false, false]).contains("1 of 3 requirements is met, 2 are not"));
    assert!(judged(&[true, true, false]).contains("2 of 3 requirements are met, 1 is not"));
}

#[test]
fn an_empty_study_gives_a_valid_page() {
    let study = Study::default();
    assert!(plots(&study).is_empty());
    let page = html(&study);
    texts(&page);
    assert!(page.contains("No runs."));
    // Plots without runs, and runs without samples.
    let mut study = hostile();
    study.runs.clear();
    texts(&html(&study));
    study.runs = vec![Run { series: Series::default(), ..run("one", "0 deg", 1.0) }];
    texts(&html(&study));
    plots(&study).iter().for_each(|file| drop(texts(&file.svg)));
}

#[test]
fn the_page_of_an_analysis_is_well_formed_and_fetches_nothing() {
    let analyses = [example::two_bodies(), example::train(), example::hostile(HOSTILE), Analysis::default()];
    for (k, analysis) in analyses.iter().enumerate() {
        let page = kardan_report::analysis(analysis).html();
        texts(&page);
        for forbidden in ["http:", "https:", "://", "src=", "@import", "<script", "url(", "\u{1}", "NaN", "inf\""] {
            assert!(!page.contains(forbidden), "{forbidden:?} in page {k}");
        }
        assert_eq!(page, kardan_report::analysis(analysis).html(), "the same analysis, the same bytes");
        let sections = page.matches("<section id=").count();
        assert_eq!(page.matches("href=\"#").count(), sections, "all sections are in the contents");
    }
}

#[test]
fn the_page_of_an_analysis_shows_what_was_found() {
    let bodies = kardan_report::analysis(&example::two_bodies()).html();
    for text in [
        "Neither controllable (rank 3 of 4) nor observable",
        "all assumptions hold",
        "the mode at −1 1/s (root of s + 1)",
        "each root of s + 1 has 2 independent eigenvectors",
        "proven over the rationals",
        "2×",
        "kg m²",
        "class=\"pole failing\"",
        "class=\"zero\"",
    ] {
        assert!(bodies.contains(text), "{text:?} is missing");
    }
    let train = kardan_report::analysis(&example::train()).html();
    for text in [
        "Coulomb torque [N m]",
        "not minimum phase",
        "ζ 0.05",
        "others",
        "Table of 14 sets",
        "nonlinear",
        "joint - 2 rack",
        "Distance to the nearest loss",
        "no loss of observability within 4 tolerances: proven",
    ] {
        assert!(train.contains(text), "{text:?} is missing");
    }
    assert_eq!(train.matches("<figure").count(), 4);
}

#[test]
fn an_analysis_is_a_section_of_the_report_on_runs() {
    let study = Study { analysis: Some(example::train()), ..hostile() };
    let page = html(&study);
    texts(&page);
    assert!(page.contains("<section id=\"analysis\">") && page.contains("href=\"#analysis\">Structure analysis<"));
    assert!(page.contains("<h4>Mode shapes</h4>"));
    // The section has a contents of its own, and says whose analysis it is.
    assert_eq!(page.matches("href=\"#analysis-").count(), page.matches("<h3 id=\"analysis-").count());
    assert!(page.contains("Variant beta = 0 deg;"), "the first of several");
    assert!(!html(&hostile()).contains("id=\"analysis\""));
}

#[test]
fn short_runs_are_shown_in_milliseconds() {
    let study = Study { runs: vec![run("quick", "0 deg", 2e-3)], ..hostile() };
    let page = html(&study);
    texts(&page);
    assert!(page.contains("\"clock\":{\"per_second\":1e3,\"unit\":\"ms\"}") && page.contains("time [ms]"));
    assert!(!page.contains("time [s]"));
    // The last of 5000 samples of a growing sine is its maximum, at 2 ms.
    assert!(page.contains(">2 ms<"), "the place of the maximum");
    assert!(texts(&plots(&study)[0].svg).contains("time [ms]"));
}

fn designs() -> [Design; 4] {
    let hostile = example::hostile_design(HOSTILE);
    [example::decoupled_steering(), example::observed_train(), hostile, Design::default()]
}

#[test]
fn the_page_of_a_design_is_well_formed_and_fetches_nothing() {
    for (k, design) in designs().iter().enumerate() {
        let page = kardan_report::design(design).html();
        texts(&page);
        for forbidden in ["http:", "https:", "://", "src=", "@import", "<script", "url(", "\u{1}", "NaN", "inf\""] {
            assert!(!page.contains(forbidden), "{forbidden:?} in page {k}");
        }
        assert_eq!(page, kardan_report::design(design).html(), "the same design, the same bytes");
        let sections = page.matches("<section id=").count();
        assert_eq!(page.matches("href=\"#").count(), sections, "all sections are in the contents");
    }
}

#[test]
fn the_page_of_a_design_shows_what_was_designed() {
    let steering = kardan_report::design(&example::decoupled_steering()).html();
    for text in [
        "Decoupled by static state feedback, proven exactly; the zero dynamics are stable; 1 warning.",
        "class=\"failure\"",
        "Static state feedback decouples every output from the others.",
        "title=\"-338911/11000\">−30.8101<",
        "−51/110",
        "<p class=\"bad\">−93.636 ± 948.85 j 1/s: lightly damped",
        "<td>zero dynamics</td>",
        "−25500/11",
        "✓ 0 (exact)",
        "400/(s² + 28 s + 400)",
        "lightly damped",
        "torsion_bar\u{a0}50\u{a0}%",
        "class=\"frame\"",
        "0.023 %",
        "Deviations in the nonlinear simulation, over 2 s",
        "Block StateSpace of kardan-rt, in continuous time.",
        "simulation also include: driver_model.",
    ] {
        assert!(steering.contains(text), "{text:?} is missing");
    }
    assert_eq!(steering.matches("<figure").count(), 2);
    let train = kardan_report::design(&example::observed_train()).html();
    for text in [
        "Not decoupled; the closed loop is unstable; 2 warnings.",
        "✗ never",
        "with 2 integrators before motor - 2 wheel_motor",
        "{rack.phi, driver.tau}",
        "The rows of rack.phi and driver.tau in G are parallel",
        "a Kalman filter",
        "the run failed",
        "States by channel: rack.phi 2, driver.tau 4; in no channel of their own: 1; not controllable: 0.",
        "class=\"pole failing\"",
        "wg.phi - 51 rk.phi + 50 fs.phi",
        "−3 ± 4 j, 0 1/s",
        "every 0.001 s",
        "The charge V.q is an integrator without effect: nothing depends on it and no law controls it.",
    ] {
        assert!(train.contains(text), "{text:?} is missing");
    }
}

#[test]
fn designs_are_sections_of_a_report() {
    let [steering, train, ..] = designs();
    let page = kardan_report::study(&Study { designs: vec![steering, train], ..hostile() }).html();
    texts(&page);
    assert!(page.contains("<section id=\"design-1\">\n<h2>Design of column</h2>"));
    assert!(page.contains("<h3 id=\"design-2-observer\">") && page.contains("<h4>Pole map</h4>"));
    assert_eq!(page.matches("href=\"#design-").count() - 2, page.matches("<h3 id=\"design-").count());
}

#[test]
fn two_bodies_read_as_a_whole() {
    let shown = kardan_report::analysis(&example::two_bodies()).text("built-in model two-bodies");
    assert_eq!(shown, include_str!("text_two_bodies.txt"), "\n{shown}");
}

#[test]
fn the_steering_reads_as_a_whole() {
    let shown = kardan_report::design(&example::decoupled_steering()).text("built-in model sia-steering");
    assert_eq!(shown, include_str!("text_steering.txt"), "\n{shown}");
}

/// Every page that the examples give.
fn pages() -> Vec<Page> {
    let analyses = [example::two_bodies(), example::train(), example::hostile(HOSTILE), Analysis::default()];
    let analyses = analyses.iter().map(kardan_report::analysis);
    analyses
        .chain(designs().iter().map(kardan_report::design))
        .chain([kardan_report::study(&hostile()), kardan_report::study(&Study::default())])
        .collect()
}

#[test]
fn lines_of_text_fit_and_have_no_control_characters() {
    for page in pages() {
        let hostile = page.text("here").contains("alert");
        for line in page.text("here").lines() {
            assert!(hostile || line.chars().count() <= 100, "{line}");
            assert_eq!(line, line.trim_end());
            assert!(!line.contains(char::is_control) && !line.contains("NaN"), "{line:?}");
        }
    }
}

/// On a narrow terminal nothing is wider than it, but for single long words, and nothing is left out.
#[test]
fn text_fits_a_narrow_terminal() {
    for page in pages() {
        let hostile = page.text("here").contains("alert");
        let narrow = page.text_of_width("here", 40);
        for line in narrow.lines().filter(|_| !hostile) {
            let long = line.split_whitespace().map(|word| word.chars().count()).max().unwrap_or(0);
            assert!(line.chars().count() <= 40.max(long + 6), "{line}");
            assert_eq!(line, line.trim_end());
        }
        assert!(page.text_of_width("here", 0).len() >= narrow.len() / 2);
        assert_eq!(page.text_of_width("here", 1000), page.text("here"));
    }
    let run = kardan_report::study(&hostile());
    let narrow = run.text_of_width("here", 40).split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(narrow.contains("Key figures") && narrow.contains("minimum: "), "{narrow}");
}

/// Whatever the width, a name stands in one line: nobody can type it in from two.
#[test]
fn names_never_break_in_a_table() {
    let names = ["rotor.friction_recordings_1", "output_shaft.quadratic_damping", "ml"];
    let one = |name: &str| IdentifiedParameter {
        name: name.into(),
        unit: "N m s^2/rad^2".into(),
        value: Some(1.234_567_8e-5),
        standard_error: Some(1e-7),
        remark: "idf_neg_0.04_1.mat from the mean of all that turned the same way".into(),
        ..IdentifiedParameter::default()
    };
    let suggestion = |name: &&str| Suggestion {
        term: (*name).into(),
        raised_by: "no dependence on output_shaft.w".into(),
        gain: Some(0.1),
        gain_spread: Some(0.01),
        probability: Some(1e-9),
        verdict:
            "the same torques as output_shaft.quadratic_damping in these logs: the logs do not distinguish the two"
                .into(),
        ..Suggestion::default()
    };
    let suggestions = Suggestions { tested_terms: names.iter().map(suggestion).collect(), ..Suggestions::default() };
    let found = Identification {
        parameters: names.map(one).to_vec(),
        suggestions: Some(suggestions),
        ..Identification::default()
    };
    let page = kardan_report::identification(&found);
    for width in 60..=100 {
        let text = page.text_of_width("here", width);
        for name in &names {
            assert!(text.split_whitespace().filter(|word| word == name).count() >= 2, "{width}: {name}\n{text}");
        }
    }
}

#[test]
fn the_text_cuts_long_lists_and_says_what_went_wrong() {
    let single_spaced = |text: String| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let shown = single_spaced(kardan_report::analysis(&example::train()).text("here"));
    for part in [
        "2 of 3 assumptions do not hold",
        "by joint: its ratio depends on the angle of driver",
        "rack_friction",
        "stuck: a constraint here",
        "… and 6 more; --json gives all",
        "No set makes the model observable: no candidate shows driver",
        "Some zeros lie in the right half-plane",
        "at most 3.1e-17",
        "nonlinear",
        "The motion along joint - 2 rack has no inertia",
        "z1 = 2 joint.w + rack.w",
    ] {
        assert!(shown.contains(part), "{part} missing in\n{shown}");
    }
    let shown = single_spaced(kardan_report::design(&example::observed_train()).text("here"));
    for part in [
        "Not decoupled; the closed loop is unstable",
        "WARNING: The law cancels an unstable mode at 420 1/s.",
        "wheel.w NEVER",
        "with 2 integrators before motor - 2 wheel_motor",
        "DOES NOT DECAY",
        "NOT stable: UNSTABLE (decided exactly)",
        "WARNING: 420 1/s: unstable",
        "0 (exact)",
        "(-3/2 s)/(s^4 + 21 s^3",
        "WARNING: Step of ref_torque by 1 rad: the run stopped at 0.3 s",
        "not controllable: 0",
    ] {
        assert!(shown.contains(part), "{part} missing in\n{shown}");
    }
}

/// The cells of a row of Markdown: a bar behind a backslash is none.
fn bars(line: &str) -> usize {
    line.replace("\\\\", "").replace("\\|", "").matches('|').count()
}

#[test]
fn markdown_has_whole_tables_and_says_what_the_page_says() {
    let mut tables = 0;
    for page in pages() {
        let text = page.markdown();
        let lines: Vec<&str> = text.lines().collect();
        for (k, line) in lines.iter().enumerate().filter(|(_, line)| line.starts_with("| ---")) {
            tables += 1;
            let rows = lines[k - 1..].iter().take_while(|line| line.starts_with('|'));
            let counts: Vec<usize> = rows.map(|line| bars(line)).collect();
            assert!(counts.len() > 2 && counts.iter().all(|count| *count == counts[0]), "{line}: {counts:?}");
            assert!(lines[k - 2].is_empty(), "a table begins after an empty line");
        }
        // What stands between backticks is shown as it is.
        let loose = text.replace("\\`", "");
        let loose = loose.lines().flat_map(|line| line.split('`').step_by(2));
        assert!(loose.clone().all(|part| !part.replace("\\<", "").contains('<')), "markup of a name");
        assert_eq!(text.matches("\n## ").count(), page.sections.len());
    }
    assert!(tables > 40, "{tables} tables");
    let text = kardan_report::design(&example::decoupled_steering()).markdown();
    for part in [
        "# sia-steering: column\n",
        "**Decoupled by static state feedback, proven exactly; the zero dynamics are stable; 1 warning.**",
        "> **Warning:** The law cancels a mode at -93.636 ± 948.85 j 1/s",
        "## Closed-loop poles",
        "States (6): `rk.phi`, `fs.phi`, `cj.phi`, `rk.w`, `fs.w`, `cj.w`",
        "| rk.phi | `400/(s^2 + 28 s + 400)` | ✓ 0 (exact) |",
        "−30.8100909",
    ] {
        assert!(text.contains(part), "{part} missing in\n{text}");
    }
}

#[test]
fn sentences_name_shafts_and_elements() {
    let mut bodies = example::two_bodies();
    let built = bodies.structure.construction.as_mut().unwrap();
    built.input = vec![vec!["-1".into(), "0".into()], vec!["-2".into(), "1/2".into()]];
    built.steps[0].multiplier = "-2".into();
    let [bodies, train] = [bodies, example::train()].map(|one| {
        let text = kardan_report::analysis(&one).text("here");
        text.split_whitespace().collect::<Vec<_>>().join(" ")
    });
    for part in ["on -body_1 - 2 body_2; input 2 acts on 1/2 body_2.", "-2 times body_1 in input 1."] {
        assert!(bodies.contains(part), "{part} missing in\n{bodies}");
    }
    for part in [" at 1", "more than 12 %", "2.4 tolerances, outside", "-1.2 ± 88 j", "not decided", "10000 samples"] {
        assert!(train.contains(part), "{part} missing in\n{train}");
    }
}

#[test]
fn the_verdict_says_how_it_was_decoupled_and_what_is_wrong() {
    let rendered = |design: &Design| kardan_report::design(design).text("here");
    let verdict = |sound: bool, text: &str| Verdict { sound, text: text.into() };
    let mut design = example::decoupled_steering();
    assert!(design.verdict().sound);
    design.feedback = None;
    design.warnings.clear();
    assert_eq!(design.verdict(), verdict(true, "Decoupled, proven exactly; the zero dynamics are stable."));
    design.zero_dynamics.stability = StabilityVerdict::plain(Stability::Unstable, StabilityEvidence::Exactly);
    assert!(!design.verdict().sound && rendered(&design).contains("NOT stable"));
    design.zero_dynamics = ZeroDynamics { polynomial: "1".into(), ..ZeroDynamics::default() };
    design.feedback = Some(Feedback::Block);
    assert!(design.verdict().text.ends_with("in blocks by static state feedback, proven exactly; no zero dynamics."));
    design.decoupled = None;
    design.decouplability.possible = Feedback::Impossible;
    assert_eq!(design.verdict(), verdict(false, "The outputs cannot be decoupled; no zero dynamics."));
    assert!(rendered(&design).contains("No state feedback decouples the outputs."));
    let plain = Design { law: "lqr".into(), ..Design::default() };
    assert_eq!(plain.verdict(), verdict(true, "Designed; decoupling was not requested."));
    assert!(!rendered(&plain).contains("Decoupling") && !rendered(&plain).contains("Zero dynamics"));
}
