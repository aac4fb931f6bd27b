//! Bad model files: every mistake is told at once, at its place, with a reason and a hint, and nothing else is.
//!
//! Each `tests/bad/NAME.toml` says in a comment what is wrong with it; `NAME.txt` beside it is what [`study::check`] has
//! to say. `UPDATE_EXPECTED=1 cargo test -p kardan --test model diagnostics` rewrites the texts; read the difference.

use std::fs;
use std::path::{Path, PathBuf};

use kardan::diagnostics::{Diagnostic, Severity, plain};
use kardan::results::{Physical, Study};
use kardan::{model, study};
use proptest::prelude::*;

fn bad_files() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad");
    let mut files: Vec<PathBuf> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|p| p.extension().is_some_and(|e| e == "toml"))
        .collect();
    files.sort();
    assert!(files.len() > 30, "only {} bad model files", files.len());
    files
}

#[test]
fn every_bad_file_is_explained() {
    let update = std::env::var_os("UPDATE_EXPECTED").is_some_and(|value| value == "1");
    let mut differences = String::new();
    for file in bad_files() {
        let source = fs::read_to_string(&file).unwrap();
        let found = plain(&source, &study::check(&source));
        let expected = file.with_extension("txt");
        if update {
            fs::write(&expected, &found).unwrap();
        }
        let stored = fs::read_to_string(&expected).unwrap_or_else(|_| "(this file is missing)\n".into());
        if stored != found {
            differences += &format!("--- {}\n{stored}+++ found\n{found}\n", expected.display());
        }
    }
    assert!(differences.is_empty(), "UPDATE_EXPECTED=1 accepts these:\n{differences}");
}

/// Every mistake says where it is, what is wrong and what to do; places lie in the file and come in its order.
#[test]
fn every_error_has_a_place_and_a_hint() {
    for file in bad_files() {
        let source = fs::read_to_string(&file).unwrap();
        let found = study::check(&source);
        assert!(!found.is_empty(), "{}", file.display());
        let whole_file = |d: &Diagnostic| matches!(d.code, "file::empty" | "model::no-shaft");
        for diagnostic in &found {
            assert!(
                diagnostic.help.as_ref().is_some_and(|help| !help.is_empty()),
                "{}: {diagnostic:?}",
                file.display()
            );
            assert!(!diagnostic.labels.is_empty() || whole_file(diagnostic), "{}: {diagnostic:?}", file.display());
            for label in &diagnostic.labels {
                assert!(source.get(label.place.span()).is_some(), "{}: {diagnostic:?}", file.display());
                assert!(
                    !label.place.span().is_empty() || diagnostic.code == "toml::syntax",
                    "{}: {diagnostic:?}",
                    file.display()
                );
            }
        }
        let places: Vec<usize> =
            found.iter().filter_map(|d| d.labels.first()).map(|label| label.place.start()).collect();
        assert!(places.is_sorted(), "{}", file.display());
    }
}

/// Unrelated mistakes of several tables are told in one go: the codes in file order.
#[test]
fn unrelated_errors_are_all_reported() {
    for (name, codes) in [
        (
            "many-1",
            "name::unknown unit::unknown name::unknown unit::dimension name::unknown name::unknown scenario::tolerance \
             name::unknown key::missing name::unknown",
        ),
        (
            "many-2",
            "unit::dimension unit::dimension name::unknown unit::dimension name::unknown unit::dimension name::unknown \
             unit::dimension name::unknown",
        ),
        (
            "many-3",
            "damping::not-passive model::disconnected control::design scenario::rows event::after-end name::unknown",
        ),
    ] {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad").join(name).with_extension("toml");
        let found = study::check(&fs::read_to_string(file).unwrap());
        let found: Vec<&str> = found.iter().map(|d| d.code).collect();
        assert_eq!(found, codes.split_whitespace().collect::<Vec<_>>(), "{name}");
    }
}

/// Parts that nothing connects run side by side, each as its own equation says, and a note tells of them.
#[test]
fn unconnected_parts_are_a_note() {
    let source = r#"
[shaft.a]
inertia = "2 kg m^2"
[motor.m]
shaft = "a"
[shaft.b]
inertia = "1 kg m^2"
[motor.n]
shaft = "b"
[scenario]
duration = "1 s"
[[scenario.event]]
at = "0 s"
signal = "m.tau"
to = "1 N m"
[[scenario.event]]
at = "0 s"
signal = "n.tau"
to = "3 N m"
"#;
    let found = study::check(source);
    let codes: Vec<_> = found.iter().map(|d| (d.code, d.severity)).collect();
    assert_eq!(codes, [("model::disconnected", Severity::Warning)], "{found:?}");
    let study = study::run(source, &study::Settings::default(), &study::Silent).unwrap();
    assert!(
        study.warnings.iter().any(|warning| warning.contains("2 parts that nothing connects")),
        "{:?}",
        study.warnings
    );
    // u t²/2J.
    for (signal, angle) in [("a.phi", 0.25), ("b.phi", 1.5)] {
        let end = *study.runs[0].series.signal(signal).unwrap().values.last().unwrap();
        assert!((end - angle).abs() < 1e-12, "{signal}: {end}");
    }
    study::analyze(source, &study::AnalyzeSettings::default(), &study::Silent).unwrap();
    // A motion without inertia is refused all the same.
    let massless = source.replace("inertia = \"1 kg m^2\"", "damping = \"0 N m s/rad\"");
    assert!(study::check(&massless).iter().any(|d| d.code == "model::massless" && d.severity == Severity::Error));
}

/// The work for a mistake does not grow with their number: thirty thousand of them within the bound of `check`.
#[test]
fn thirty_thousand_errors_are_reported() {
    let mut source = String::new();
    for k in 0..30_000 {
        source += &format!("[shaft.s{k}]\ninertia = \"1 kq m^2\"\n");
    }
    let found = study::check(&source);
    assert_eq!(found.iter().filter(|d| d.code == "unit::unknown").count(), 30_000);
    let text = plain(&source, &found);
    assert!(text.contains("error[unit::unknown] 60000:"), "{}", &text[text.len() - 300..]);
}

/// Names that are not there, each of which is near to many that are: looked up in maps, and what may have been meant is told of the
/// first ones only, as that compares each with all.
#[test]
fn thousands_of_misspelt_names_are_reported() {
    let count = 5_000;
    let mut source = String::new();
    for k in 0..count {
        source += &format!("[shaft.s{k}]\ninertia = \"1 kg m^2\"\n");
    }
    for k in 0..count {
        source += &format!("[sensor.e{k}]\nmeasures = \"angle\"\nshaft = \"t{k}\"\n");
    }
    let found = study::check(&source);
    let unknown: Vec<_> = found.iter().filter(|d| d.code == "name::unknown").collect();
    assert_eq!(unknown.len(), count);
    let guessed = |d: &&&Diagnostic| d.help.as_deref().is_some_and(|help| help.starts_with("did you mean"));
    assert!(guessed(&&unknown[0]) && (1..1000).contains(&unknown.iter().filter(guessed).count()));
    assert!(unknown.iter().all(|d| d.help.is_some()));
}

/// Shafts in a row, each behind a universal joint of the one before.
fn joints_in_series(count: usize) -> String {
    let shafts = (0..=count).map(|k| format!("[shaft.s{k:04}]\ninertia = \"1e-3 kg m^2\"\n"));
    let joints = (0..count).map(|k| {
        let (one, two) = (format!("s{k:04}"), format!("s{:04}", k + 1));
        format!("[universal_joint.j{k:04}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{two}\"\nangle = \"20 deg\"\n")
    });
    shafts.chain(joints).collect()
}

#[test]
fn too_many_joints_in_series_are_refused_with_their_number() {
    assert!(study::check(&joints_in_series(20)).is_empty());
    let found = study::check(&joints_in_series(1400));
    assert_eq!((found.len(), found[0].code), (1, "constraint::depth"), "{found:?}");
    assert!(found[0].message.contains("through 1400 transmissions"), "{}", found[0].message);
}

#[test]
fn the_models_of_the_program_are_right() {
    for builtin in model::BUILTIN {
        let found = study::check(builtin.source);
        let reported = match builtin.name {
            "harmonic-drive" | "harmonic-drive-ecu" => vec!["damping::negative"],
            // The zero dynamics is a double integrator in the loop of both motors: it runs away if one gives more than it is told.
            "harmonic-drive-spring" => vec!["control::low-margins"; 2],
            // One of its runs begins behind an engaged lock, which no map knows.
            "steering-on-road" => vec!["block::not-in-design"],
            _ => Vec::new(),
        };
        let codes: Vec<&str> = found.iter().map(|d| d.code).collect();
        assert_eq!(codes, reported, "{}: {found:?}", builtin.name);
        assert!(found.iter().all(|d| d.severity == Severity::Warning));
    }
}

/// Words that a mutation puts where another word was.
const NAMES: &[&str] = &[
    "1e300",
    "1e-300",
    "1e400",
    "1e-400",
    "1e-9",
    "0",
    "-1",
    "51/50",
    "1/0",
    "nan",
    "inf",
    "pi",
    "1e308",
    "5e-324",
    "9e99999",
    "\"1e300 kg m^2\"",
    "\"1e-300 kg m^2\"",
    "\"1e300 rad\"",
    "\"0 N m\"",
    "\"-1e9 N m s/rad\"",
    "\"90 deg\"",
    "\"1 kg m^2 ± 10 %\"",
    "\"(1 ± 2) N m\"",
    "\"0.1 N m s/rad [0, 1] 95 %\"",
    "±",
    "\"beta\"",
    "\"rk\"",
    "\"fs\"",
    "\"cs\"",
    "\"wg\"",
    "\"cj\"",
    "\"rk.phi\"",
    "\"fs.w\"",
    "\"body_1\"",
    "\"n1\"",
    "\"ground\"",
    "\"L2.i\"",
    "\"-1e300 uF\"",
    "\"\"",
    "true",
    "[]",
    "{}",
    "[",
    "]",
    "[[",
    "]]",
    "\"",
    "'''",
    "=",
    "#",
    "shaft",
    "gear",
    "constraint",
    "[shaft.new]",
    "[\"rk\"]",
    "[\"rk\", \"fs\", \"wg\"]",
    "coordinates",
    "coefficients",
    "{ rk = 1, fs = -1 }",
    "{ cs = 1e300, wg = 1e-300 }",
    "noninteracting",
    "position_loop",
    "\\",
    "ä",
    "🦀",
    "\u{feff}",
    "\r",
    "\t",
    "1979-05-27",
    "[0, 10, 20] deg",
];

/// Whole tables that a mutation adds.
const TABLES: &[&str] = &[
    "\n[gear.more]\nshaft_1 = \"rk\"\nshaft_2 = \"fs\"\nratio = 1e-9\n",
    "\n[gear.more]\nshaft_1 = \"cs\"\nshaft_2 = \"wg\"\nratio = 1e300\noffset = \"1e300 rad\"\n",
    "\n[constraint.more]\ncoefficients = { rk = 1, fs = \"51/50\", cj = 0 }\n",
    "\n[constraint.more]\ncoefficients = { body_1 = 1e300, body_2 = 1e-300 }\noffset = \"1e300 rad\"\n",
    "\n[constraint.hold]\ncoefficients = { fs = 1 }\n",
    "\n[universal_joint.more]\nshaft_1 = \"fs\"\nshaft_2 = \"wg\"\nangle = \"89.9 deg\"\nphase = \"1e300 rad\"\n",
    "\n[universal_joint.more]\nshaft_1 = \"rk\"\nshaft_2 = \"fs\"\nangle_1 = \"10 deg\"\nangle_2 = \"10 deg\"\n",
    "\n[sensor.more]\nmeasures = \"torque\"\nelement = \"torsion_bar\"\nshaft = \"rk\"\nlines = 3\n",
    "\n[sensor.more]\nmeasures = \"torque\"\nelement = \"hd\"\n",
    "\n[[analysis.actuator]]\nshaft = \"rk\"\n",
    "\n[[analysis.sensor]]\nshaft = \"body_1\"\nmeasures = \"speed\"\ncost = \"1e300\"\n",
    "\n[motor.more]\nshaft = \"fs\"\nlag = \"1e-300 s\"\n",
    "\n[control.more]\nlaw = \"position_loop\"\noutput = \"fs.phi\"\ninput = \"more\"\nreference = \"fs\"\n",
    "\n[control.more]\nlaw = \"position_loop\"\noutput = \"fs.phi\"\ninput = \"wg_motor\"\nreference = \"r\"\n",
    "\n[voltage_source.more]\nfrom = \"n1\"\nto = \"in\"\n",
    "\n[resistor.more]\nfrom = \"n1\"\nto = \"rk\"\nresistance = \"0 Ohm\"\n",
    "\n[transformer.more]\nfrom_1 = \"n1\"\nto_1 = \"n2\"\nfrom_2 = \"s\"\nto_2 = \"ground\"\nratio = \"1e300\"\n",
];

#[derive(Debug, Clone)]
enum Mutation {
    DeleteLine(usize),
    DuplicateLine(usize, usize),
    SwapLines(usize, usize),
    DeleteCharacter(usize),
    InsertCharacter(usize, char),
    ReplaceWord(usize, usize),
    SwapTokens(usize, usize),
    ReplaceValue(usize, usize),
    AddTable(usize),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let n = 0..100_000usize;
    prop_oneof![
        n.clone().prop_map(Mutation::DeleteLine),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::DuplicateLine(a, b)),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::SwapLines(a, b)),
        n.clone().prop_map(Mutation::DeleteCharacter),
        (n.clone(), any::<char>()).prop_map(|(a, c)| Mutation::InsertCharacter(a, c)),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::ReplaceWord(a, b)),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::SwapTokens(a, b)),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::ReplaceValue(a, b)),
        (n.clone(), n.clone()).prop_map(|(a, b)| Mutation::ReplaceValue(a, b)),
        n.prop_map(Mutation::AddTable),
    ]
}

/// Byte ranges of the words of a text.
fn word_ranges(text: &str) -> Vec<std::ops::Range<usize>> {
    let is_word = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '-');
    let tokens = text.split(|c| !is_word(c)).filter(|word| !word.is_empty());
    let start = |word: &str| word.as_ptr() as usize - text.as_ptr() as usize;
    tokens.map(|word| start(word)..start(word) + word.len()).collect()
}

fn mutate(text: &str, mutation: &Mutation) -> String {
    let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
    let mut characters: Vec<char> = text.chars().collect();
    let tokens = word_ranges(text);
    if lines.is_empty() || tokens.is_empty() {
        return text.to_string();
    }
    let (n, m, w) = (lines.len(), characters.len(), tokens.len());
    match *mutation {
        Mutation::DeleteLine(a) => drop(lines.remove(a % n)),
        Mutation::DuplicateLine(a, b) => lines.insert(b % n, lines[a % n].clone()),
        Mutation::SwapLines(a, b) => lines.swap(a % n, b % n),
        Mutation::DeleteCharacter(a) => {
            characters.remove(a % m);
            return characters.into_iter().collect();
        }
        Mutation::InsertCharacter(a, c) => {
            characters.insert(a % m, c);
            return characters.into_iter().collect();
        }
        Mutation::ReplaceWord(a, b) => {
            let range = tokens[a % w].clone();
            return format!("{}{}{}", &text[..range.start], NAMES[b % NAMES.len()], &text[range.end..]);
        }
        Mutation::SwapTokens(a, b) => {
            let (a, b) = (tokens[(a % w).min(b % w)].clone(), tokens[(a % w).max(b % w)].clone());
            if a != b {
                let (first, second) = (&text[a.clone()], &text[b.clone()]);
                return format!("{}{second}{}{first}{}", &text[..a.start], &text[a.end..b.start], &text[b.end..]);
            }
        }
        Mutation::ReplaceValue(a, b) => {
            let keyed: Vec<usize> = (0..n).filter(|&k| lines[k].contains('=')).collect();
            if let Some(&k) = keyed.get(a % keyed.len().max(1)) {
                lines[k] = format!("{}= {}", lines[k].split('=').next().unwrap_or(""), NAMES[b % NAMES.len()]);
            }
        }
        Mutation::AddTable(a) => return text.to_string() + TABLES[a % TABLES.len()],
    }
    lines.join("\n") + "\n"
}

proptest! {
    #![proptest_config(ProptestConfig { cases: crate::common::random_models(64), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is done to a model file, checking it ends soon, without a panic, with places that lie in the file.
    #[test]
    fn a_mutated_model_is_read_or_refused(
        number in 0..model::BUILTIN.len(),
        mutations in prop::collection::vec(mutation(), 1..8),
    ) {
        let mut source = model::BUILTIN[number].source.to_string();
        for mutation in &mutations {
            source = mutate(&source, mutation);
        }
        for diagnostic in study::check(&source) {
            prop_assert!(diagnostic.help.is_some(), "{diagnostic:?}");
            prop_assert!(diagnostic.labels.iter().all(|label| source.get(label.place.span()).is_some()), "{diagnostic:?}");
        }
    }
}

/// A block with a mistake is told alone: neither what reads it, nor runs that are looked at beforehand.
#[test]
fn a_block_with_errors_is_reported_once() {
    let source = model::builtin("afs-steering").unwrap().source;
    let (before, block) = source.split_once("[block.stabilise]").unwrap();
    let mistaken = format!("{before}[block.stabilise]{}", block.replacen("unit = \"rad\"", "input = \"0 rad\"", 1));
    let incomplete = source.replacen("kind = \"sine_with_dwell\"\n", "", 1);
    for (source, code, named) in [(mistaken, "key::unknown", "`stabilise`"), (incomplete, "key::missing", "`dwell`")] {
        let found = study::check(&source);
        let remaining = found.iter().filter(|one| one.code != "requirement::window");
        assert_eq!(remaining.map(|one| one.code).collect::<Vec<_>>(), [code], "{found:?}");
        assert!(found[0].message.contains(named), "{found:?}");
    }
}

/// Numbers at the ends of what a number can be, at every place of a small model.
#[test]
fn extreme_numbers_are_read_or_refused() {
    let numbers = ["0", "1e300", "1e-300", "1e308", "5e-324", "1e-9", "-1e300", "1e400", "1e-400", "1e400000000000"];
    let template = |values: [&str; 7]| {
        let [inertia, stiffness, damping, friction, ratio, offset, angle] = values;
        format!(
            "[shaft.a]\ninertia = \"{inertia} kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\n\
             damping = \"{damping} N m s/rad\"\nfriction = \"{friction} N m\"\n[shaft.c]\n\
             [shaft.d]\ninertia = \"1 kg m^2\"\n\
             [gear.g]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nratio = {ratio}\noffset = \"{offset} rad\"\n\
             [spring_damper.s]\nshaft_1 = \"b\"\nshaft_2 = \"d\"\nstiffness = \"{stiffness} N m/rad\"\n\
             [universal_joint.j]\nshaft_1 = \"c\"\nshaft_2 = \"d\"\nangle = \"{angle} deg\"\n\
             [motor.m]\nshaft = \"a\"\n\
             [control.l]\nlaw = \"position_loop\"\noutput = \"a.phi\"\ninput = \"m\"\nreference = \"r\"\n"
        )
    };
    let usual = ["1", "1", "1", "1", "1", "0", "10"];
    // Body d swings on its spring undamped, next to where the loop crosses over: a small turn of the phase is too much.
    let found = study::check(&template(usual));
    assert_eq!(found.iter().map(|one| one.code).collect::<Vec<_>>(), ["control::low-margins"], "{found:?}");
    let mut checked = 0;
    for first in 0..usual.len() {
        for second in 0..=first {
            for (k, number) in numbers.iter().enumerate() {
                let mut values = usual;
                values[first] = number;
                values[second] = numbers[(k * 7 + first) % numbers.len()];
                study::check(&template(values));
                checked += 1;
            }
        }
    }
    assert!(checked > 250);
}

/// The tables of a model file, each from its header on.
fn tables(source: &str) -> Vec<String> {
    let mut out = vec![String::new()];
    for line in source.lines() {
        if line.starts_with('[') {
            out.push(String::new());
        }
        let last = out.len() - 1;
        out[last] += line;
        out[last].push('\n');
    }
    out
}

/// The tables of the steering model without its requirements, which look beyond the two seconds that are run here.
fn short_steering() -> Vec<String> {
    let source = model::builtin("sia-steering").unwrap().source.replace("duration = \"9 s\"", "duration = \"2 s\"");
    tables(&source).into_iter().filter(|table| !table.starts_with("[[requirement")).collect()
}

fn run_one(source: &str, variant: &str) -> Study {
    let settings = study::Settings { variants: vec![variant.to_string()], ..Default::default() };
    study::run(source, &settings, &study::Silent).unwrap_or_else(|found| panic!("{}", plain(source, &found)))
}

/// The order of the tables changes no bit of any result.
#[test]
fn order_of_tables_does_not_matter() {
    let tables = short_steering();
    let straight: String = tables.concat();
    let (lists, single): (Vec<String>, Vec<String>) = tables.into_iter().partition(|table| table.starts_with("[["));
    // Lists of tables have an order of their own and stay after the tables that they extend.
    let reversed: String = single.into_iter().rev().chain(lists).collect();
    assert_ne!(straight, reversed);
    for variant in ["beta-0deg", "beta-30deg"] {
        let (mut a, mut b) = (run_one(&straight, variant), run_one(&reversed, variant));
        assert!(a.runs[0].series.time.len() > 1000);
        // Warnings tell of late events in the order of the file.
        a.warnings.sort();
        b.warnings.sort();
        assert!(a == b, "{variant}");
    }
}

/// New names of shafts in the same order of the alphabet change no bit; in another order sums round otherwise.
#[test]
fn names_of_shafts_do_not_matter() {
    let with_friction = short_steering().concat();
    let frictionless: String =
        with_friction.lines().filter(|line| !line.starts_with("friction")).map(|line| format!("{line}\n")).collect();
    let rename = |source: &str, names: [(&str, &str); 5]| {
        let mut text = source.to_string();
        for (old, new) in names {
            for (a, b) in [("\"", "\""), ("\"", "."), ("[shaft.", "]")] {
                text = text.replace(&format!("{a}{old}{b}"), &format!("{a}{new}{b}"));
            }
        }
        text
    };
    let same_order = [("cj", "a_joint"), ("cs", "b_spline"), ("fs", "c_wheel"), ("rk", "d_rack"), ("wg", "e_wave")];
    let other_order = [("cj", "y_joint"), ("cs", "x_spline"), ("fs", "m_wheel"), ("rk", "b_rack"), ("wg", "a_wave")];
    // Rounded otherwise, the runs choose other steps and differ by their integration error: that of an angle times the
    // 3000 rad/s of the zero dynamics is that of a speed. It shrinks with the tolerance (speeds 4e-6 at 1e-8, 4e-10 at
    // 1e-13); without friction nothing damps it and the speeds keep 5e-8.
    let fine = with_friction.replace("[scenario]\n", "[scenario]\nrelative_tolerance = 1e-13\n");
    for (source, names, for_angles, for_other) in [
        (&frictionless, same_order, 0.0, 0.0),
        (&with_friction, same_order, 0.0, 0.0),
        (&frictionless, other_order, 1e-9, 1e-6),
        (&with_friction, other_order, 1e-8, 3e-5),
        (&fine, other_order, 1e-9, 1e-9),
    ] {
        let (a, b) = (run_one(source, "beta-20deg"), run_one(&rename(source, names), "beta-20deg"));
        assert_eq!(a.runs[0].series.time, b.runs[0].series.time);
        let mut compared = 0;
        for signal in &a.runs[0].series.signals {
            let mut parts: Vec<&str> = signal.name.split('.').collect();
            for part in &mut parts {
                *part = names.iter().find(|(old, _)| old == part).map_or(*part, |(_, new)| new);
            }
            let other = b.runs[0].series.signal(&parts.join(".")).unwrap_or_else(|| panic!("no {}", signal.name));
            let size = signal.values.iter().fold(1.0f64, |max, x| max.max(x.abs()));
            let tolerance = size * if signal.physical == Physical::Angle { for_angles } else { for_other };
            for (k, (x, y)) in signal.values.iter().zip(&other.values).enumerate() {
                assert!((x - y).abs() <= tolerance, "{} at row {k}: {x} and {y}", signal.name);
            }
            compared += 1;
        }
        assert!(compared > 20);
    }
}

/// A copy that was stopped: whatever is left of a model file is judged without a panic, and every place told lies inside it.
#[test]
fn models_cut_at_every_byte_are_judged() {
    for name in ["two-bodies", "two-motor-drive"] {
        let source = model::builtin(name).unwrap().source;
        for length in (0..source.len()).filter(|&length| source.is_char_boundary(length)) {
            let cut = &source[..length];
            let found = study::check(cut);
            for label in found.iter().flat_map(|one| &one.labels) {
                assert!(cut.get(label.place.span()).is_some(), "{name} cut at {length}: {label:?}");
            }
            assert!(found.iter().all(|one| !one.message.is_empty()));
            plain(cut, &found);
        }
    }
}
