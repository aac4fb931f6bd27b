//! Certificates are confirmed, and false ones refused, by code that shares nothing with the library: `certificate/checker.rs`
//! reads the JSON text and nothing else.

mod checker;

use checker::check;
use kardan::export::analysis_json;
use kardan::{model, study};
use serde_json::{Value, json};

fn analysis(name: &str, inputs: &[&str], outputs: &[&str]) -> String {
    let names = |list: &[&str]| list.iter().map(ToString::to_string).collect();
    let settings = study::AnalyzeSettings { inputs: names(inputs), outputs: names(outputs), ..Default::default() };
    let source = model::builtin(name).expect("built in").source;
    analysis_json(&study::analyze(source, &settings, &study::Silent).expect("the built-in model is right"))
}

fn state_space(system: Value) -> String {
    let found = study::analyze_state_space(system.to_string().as_bytes(), &Default::default(), &study::Silent);
    analysis_json(&found.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}")))
}

/// Repeated blocks that one input reaches in part, with E, in coordinates that hide them.
fn hidden() -> String {
    // T = L U with ones on the diagonals; A = T (companion(s² + 2) twice, 3) T⁻¹ written as E = T⁻¹, A = blocks T⁻¹.
    state_space(json!({
        "E": [[1, 2, 0, 0, 0], [0, 1, 1, 0, 0], [0, 0, 1, 0, -1], [0, 0, 0, 1, "1/2"], [0, 0, 0, 0, 1]],
        "A": [[0, 1, 1, 0, 0], [-2, -4, 0, 0, 0], [0, 0, 0, 1, "1/2"], [0, 0, -2, 0, 2], [0, 0, 0, 0, 3]],
        "B": [[1, 0], [1, 0], [0, 0], [0, 0], [0, "2/3"]],
        "C": [[1, 2, 0, 0, 0]],
    }))
}

#[test]
fn the_checker_is_short_and_independent() {
    let source = include_str!("certificate/checker.rs");
    let code = source.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//"));
    assert!(code.count() <= 102);
    assert!(!source.contains("kardan"));
}

#[test]
fn certificates_of_models_are_confirmed() {
    for (name, inputs, outputs) in [
        ("two-bodies", &[][..], &[][..]),
        ("sia-steering", &[], &[]),
        ("sia-steering", &["wg_motor"], &["rk.phi"]),
        ("sia-steering", &["driver"], &["cs.phi", "wg.phi"]),
        ("harmonic-drive", &["wg_motor"], &["wg.w"]),
        ("harmonic-drive", &["wg_motor", "cs_motor"], &["wg.phi", "cs.phi"]),
        ("harmonic-drive-spring", &[], &[]),
        ("harmonic-drive-spring", &["wg_motor"], &["fs.phi"]),
    ] {
        let text = analysis(name, inputs, outputs);
        assert_eq!(check(&text), Some(()), "{name} {inputs:?} {outputs:?}: {text}");
    }
    assert_eq!(check(&hidden()), Some(()));
}

/// Without inputs and outputs nothing is reached: the minor has no rows, and the proof that nothing is reached has all.
#[test]
fn nothing_is_confirmed_as_nothing() {
    for system in
        [json!({"A": [[1, 0], [0, 1]]}), json!({"A": [[0, 1], ["-7/3", 0]], "B": [[0], [0]]}), json!({"A": 0})]
    {
        let text = state_space(system.clone());
        let all: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(all["controllable_rank"], 0);
        assert_eq!(check(&text), Some(()), "{system}");
    }
}

/// All sizes and shapes of random systems with repeated blocks.
#[test]
fn certificates_of_random_systems_are_confirmed() {
    let mut seed = 7u64;
    let mut dice = move |low: i64, high: i64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + ((seed >> 33) % (high - low + 1) as u64) as i64
    };
    let mut kinds = [0; 4];
    for _ in 0..60 {
        let blocks = dice(1, 3) as usize;
        let (b0, b1) = (dice(-3, 3), dice(-2, 2));
        let n = 2 * blocks + dice(0, 1) as usize;
        let (m, p) = (dice(1, 3) as usize, dice(1, 2) as usize);
        // Copies of one companion block, coupled from above: E stays regular, A is changed by row operations on both.
        let mut e: Vec<Vec<i64>> = (0..n).map(|i| (0..n).map(|j| i64::from(i == j)).collect()).collect();
        let mut a = vec![vec![0; n]; n];
        for k in 0..blocks {
            a[2 * k][2 * k + 1] = 1;
            a[2 * k + 1][2 * k] = -b0;
            a[2 * k + 1][2 * k + 1] = -b1;
        }
        for _ in 0..2 * n {
            let (i, j, c) = (dice(0, n as i64 - 1) as usize, dice(0, n as i64 - 1) as usize, dice(-1, 1));
            if i != j {
                for m in [&mut e, &mut a] {
                    // Columns: other states; rows: other equations.
                    for row in m.iter_mut() {
                        row[i] += c * row[j];
                    }
                    let other = m[j].clone();
                    m[i].iter_mut().zip(&other).for_each(|(x, y)| *x -= y);
                }
            }
        }
        let mut matrix = |rows: usize, columns: usize| -> Vec<Vec<i64>> {
            (0..rows).map(|_| (0..columns).map(|_| if dice(0, 2) == 0 { dice(-2, 2) } else { 0 }).collect()).collect()
        };
        let system = json!({"E": e, "A": a, "B": matrix(n, m), "C": matrix(p, n)});
        let text = state_space(system.clone());
        assert_eq!(check(&text), Some(()), "{system}");
        let all: Value = serde_json::from_str(&text).unwrap();
        assert!(all["min_inputs"].as_u64().unwrap() >= blocks as u64, "{system}");
        kinds[usize::from(all["controllable"] == true) + 2 * usize::from(all["observable"] == true)] += 1;
    }
    assert!(kinds[0] > 0 && kinds[1] > 0, "failing and succeeding inputs: {kinds:?}");
}

/// Paths to all numbers in a value: pointers as of RFC 6901.
fn numbers(value: &Value, path: &str, out: &mut Vec<String>) {
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| numbers(value, &format!("{path}/{key}"), out)),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, value)| numbers(value, &format!("{path}/{k}"), out))
        }
        Value::Number(_) => out.push(path.into()),
        Value::String(text) if text.parse::<dashu_ratio::RBig>().is_ok() => out.push(path.into()),
        _ => {}
    }
}

/// A number and what follows it.
fn changed(value: &Value) -> Value {
    match value {
        Value::String(text) => {
            Value::String((text.parse::<dashu_ratio::RBig>().unwrap() + dashu_ratio::RBig::ONE).to_string())
        }
        Value::Number(number) if number.is_u64() => json!(number.as_u64().unwrap() + 1),
        Value::Number(number) => json!(number.as_i64().unwrap() + 1),
        other => other.clone(),
    }
}

/// Every number, changed alone, is noticed; but another witness with the same minor, or another vector of the same
/// eigenspace, is as good a proof. Of those, too, most changes are noticed.
#[test]
fn every_changed_number_is_refused() {
    let texts = [
        hidden(),
        analysis("sia-steering", &["wg_motor"], &["rk.phi"]),
        analysis("harmonic-drive", &["wg_motor"], &["wg.phi"]),
        analysis("harmonic-drive-spring", &["wg_motor"], &["fs.phi"]),
    ];
    let mut parts_checked = std::collections::BTreeSet::new();
    for text in texts {
        let all: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(check(&text), Some(()));
        for part in [
            "/states",
            "/controllable_rank",
            "/observable_rank",
            "/min_inputs",
            "/min_outputs",
            "/certificate/inputs",
            "/certificate/inputs/witness",
            "/certificate/inputs/rows",
            "/certificate/outputs",
            "/certificate/outputs/witness",
            "/certificate/outputs/rows",
            "/certificate/uncontrollable_invariant/action",
            "/certificate/uncontrollable_invariant/rows",
            "/certificate/unobservable_invariant/action",
            "/certificate/unobservable_invariant/rows",
            "/certificate/controllability_minor",
            "/certificate/observability_minor",
            "/certificate/pencil/E",
            "/certificate/pencil/A",
            "/certificate/pencil/B",
            "/certificate/pencil/C",
        ] {
            let mut paths = Vec::new();
            numbers(all.pointer(part).unwrap_or(&Value::Null), part, &mut paths);
            let vectors = |path: &str| path.contains("/rows/") && path.matches('/').count() == 5;
            let another_proof = |path: &str| !path.contains("/minor/") && (path.contains("/witness/") || vectors(path));
            let refused = paths.iter().filter(|path| {
                let mut forged = all.clone();
                let place = forged.pointer_mut(path).unwrap();
                *place = changed(place);
                let refused = check(&forged.to_string()).is_none();
                assert!(refused || another_proof(path), "{path} may be changed in {text}");
                refused
            });
            assert!(2 * refused.count() >= paths.len(), "{part} of {text}");
            if !paths.is_empty() {
                parts_checked.insert(part);
            }
        }
        for verdict in ["controllable", "observable"] {
            let mut forged = all.clone();
            forged[verdict] = json!(all[verdict] == false);
            assert_eq!(check(&forged.to_string()), None, "{verdict}");
        }
    }
    assert_eq!(parts_checked.len(), 21, "{parts_checked:?}");
}

/// What a damaged or dishonest file may hold in place of a value.
fn nonsense() -> Vec<Value> {
    let digits = "9".repeat(400);
    vec![
        Value::Null,
        json!(true),
        json!("NaN"),
        json!("inf"),
        json!("1/0"),
        json!("one"),
        json!(""),
        json!(digits),
        json!(format!("-{digits}/7")),
        json!(1e308),
        json!(-1),
        json!(0.5),
        json!(u64::MAX),
        json!(1u64 << 61),
        json!([]),
        json!({}),
    ]
}

/// Paths to everything below a value that holds something.
fn places(value: &Value, path: &str, out: &mut Vec<String>) {
    out.push(path.into());
    match value {
        Value::Object(map) => map.iter().for_each(|(key, value)| places(value, &format!("{path}/{key}"), out)),
        Value::Array(list) => list.iter().enumerate().for_each(|(k, value)| places(value, &format!("{path}/{k}"), out)),
        _ => {}
    }
}

/// Values that are no numbers, numbers of any size, parts that are missing, come twice or in another order: all is refused
/// that could matter, and nothing makes the checker panic.
#[test]
fn damaged_certificates_are_refused() {
    let texts = [hidden(), analysis("two-bodies", &[], &[]), analysis("harmonic-drive", &["wg_motor"], &["wg.phi"])];
    let mut tried = [0; 2];
    for text in texts {
        let all: Value = serde_json::from_str(&text).unwrap();
        assert_eq!(check(&text), Some(()));
        let mut try_out = |forged: &Value| {
            let refused = check(&forged.to_string()).is_none();
            tried[usize::from(refused)] += 1;
            refused
        };
        let several = all["min_inputs"].as_u64() > Some(1);
        let parts: &[&str] = &[
            "/states",
            "/state_names",
            "/kind",
            "/inputs",
            "/outputs",
            "/controllable",
            "/observable",
            "/controllable_rank",
            "/observable_rank",
            "/min_inputs",
            "/min_outputs",
            "/certificate",
        ];
        let mut paths = Vec::new();
        parts.iter().for_each(|part| places(all.pointer(part).unwrap(), part, &mut paths));
        // Not needed for the ranks and least numbers; where one input is enough, no common factor is needed.
        let optional_parts = ["/proven", "/failure_probability", "/primes", "/statements", "/pencil/D", "/stability"];
        let side = |path: &str| path.starts_with("/certificate/inputs/") || path.starts_with("/certificate/outputs/");
        paths.retain(|path| {
            let unread = optional_parts.iter().any(|prefix| path.starts_with(&format!("/certificate{prefix}")))
                || (path.starts_with("/certificate/") && side(path))
                    && !several
                    && (path.contains("/common_factor/") || path.contains("/rows/"))
                    && !path.contains("/minor/")
                || ["/kind", "/state_names/", "/inputs/", "/outputs/"].iter().any(|name| path.starts_with(name));
            !unread
        });
        for path in &paths {
            let whole = all.pointer(path).unwrap();
            // A number may be a text or not.
            let bare = |value: &Value| value.to_string().trim_matches('"').to_owned();
            for value in nonsense().into_iter().filter(|value| bare(value) != bare(whole)) {
                let mut forged = all.clone();
                *forged.pointer_mut(path).unwrap() = value.clone();
                let refused = try_out(&forged);
                // Numbers of a witness and of the vectors may be others; a list may be empty where it is not needed. A number
                // of the system makes it another system, which may have the same proof.
                let free = ["/witness/", "/rows/", "/action", "/pencil/"].iter().any(|part| path.contains(part));
                let is_number = bare(&value).parse::<dashu_ratio::RBig>().is_ok();
                let free = free && (is_number || !path.contains("/pencil/"));
                let unneeded = value.is_array() && whole.as_array().is_some_and(Vec::is_empty)
                    || whole.is_null()
                    || !several && (path.ends_with("/common_factor") || path.ends_with("s/rows"));
                assert!(refused || free || unneeded, "{path} = {value} in {text}");
            }
            let (above, key) = path.rsplit_once('/').unwrap();
            let mut forged = all.clone();
            match forged.pointer_mut(above) {
                Some(Value::Object(map)) => {
                    map.remove(key);
                    let refused = try_out(&forged);
                    let unneeded = whole.is_null() || !several && (key == "common_factor" || key == "rows");
                    assert!(refused || unneeded, "{path} is missing in {text}");
                }
                Some(Value::Array(list)) => {
                    let k: usize = key.parse().unwrap();
                    list.remove(k);
                    assert!(try_out(&forged), "{path} is missing in {text}");
                    let duplicated = |all: &Value| {
                        let mut forged = all.clone();
                        let list = forged.pointer_mut(above).unwrap().as_array_mut().unwrap();
                        list.insert(k, list[k].clone());
                        forged
                    };
                    // An entry of a sparse matrix may be told twice.
                    let entry = above.contains("/pencil/");
                    assert!(try_out(&duplicated(&all)) || entry, "{path} comes twice in {text}");
                    let mut forged = all.clone();
                    let list = forged.pointer_mut(above).unwrap().as_array_mut().unwrap();
                    if k + 1 < list.len() && list[k] != list[k + 1] {
                        list.swap(k, k + 1);
                        let refused = try_out(&forged);
                        let ordered = ["/minor/", "/controllability_minor/", "/observability_minor/"]
                            .iter()
                            .any(|part| path.contains(part));
                        assert!(refused || !ordered, "{path} is exchanged in {text}");
                    }
                }
                _ => {}
            }
        }
        // A rank that is not decided is no verdict.
        for key in ["controllable", "observable", "controllable_rank", "observable_rank"] {
            let mut forged = all.clone();
            forged[key] = Value::Null;
            assert_eq!(check(&forged.to_string()), None, "{key}");
        }
        for cut in (0..text.len()).step_by(97).filter(|&cut| text.is_char_boundary(cut)) {
            assert_eq!(check(&text[..cut]), None, "cut at {cut}");
        }
    }
    assert!(tried[1] > 5000 && tried[0] < tried[1] / 4, "{tried:?}");
}

/// `docs/check_certificate.py` as a process that answers one certificate after another.
struct Checker {
    child: std::process::Child,
    answers: std::io::Lines<std::io::BufReader<std::process::ChildStdout>>,
}

impl Checker {
    /// Each certificate comes after a line with its length; each answer is a line.
    const PROGRAM: &str = "import sys, json, check_certificate\n\
        for length in sys.stdin.buffer:\n    \
            text = sys.stdin.buffer.read(int(length)).decode()\n    \
            print(json.dumps(check_certificate.verdict(text)), flush=True)\n";

    /// `None` without Python.
    fn start() -> Option<Self> {
        use std::io::BufRead;
        let docs = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");
        let mut command = std::process::Command::new("python3");
        command.args(["-c", Self::PROGRAM]).env("PYTHONPATH", docs).env("PYTHONDONTWRITEBYTECODE", "1");
        command.stdin(std::process::Stdio::piped()).stdout(std::process::Stdio::piped());
        let mut child = command.spawn().ok()?;
        let answers = std::io::BufReader::new(child.stdout.take()?).lines();
        Some(Self { child, answers })
    }

    fn answer(&mut self, text: &str) -> (bool, String) {
        let input = self.child.stdin.as_mut().expect("piped");
        std::io::Write::write_all(input, format!("{}\n{text}", text.len()).as_bytes()).expect("the checker reads");
        let line = self.answers.next().expect("an answer").expect("text");
        serde_json::from_str(&line).expect("a verdict and a sentence")
    }
}

impl Drop for Checker {
    fn drop(&mut self) {
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

/// Asks `docs/check_certificate.py`: whether it agrees and what it says; `None` without Python.
fn python(text: &str) -> Option<(bool, String)> {
    thread_local! {
        static CHECKER: std::cell::RefCell<Option<Checker>> = std::cell::RefCell::new(Checker::start());
    }
    CHECKER.with_borrow_mut(|checker| Some(checker.as_mut()?.answer(text)))
}

/// The program that stands in the documentation confirms certificates, and refuses broken ones.
#[test]
fn the_documented_checker_confirms_and_refuses() {
    let square = state_space(json!({
        "A": [[-1, 0, 0], [0, -2, 0], [0, 0, -2]], "B": [[1, 0], [1, 0], [0, 1]], "C": [[1, 1, 0], [0, 0, 1]],
    }));
    // Two outputs of one input with a zero in common, and the same output twice for two inputs.
    let wide = state_space(json!({
        "A": [[0, 1, 0], [0, 0, 1], [-6, -11, -7]], "B": [0, 0, 1], "C": [[3, 1, 0], [0, 3, 1]],
    }));
    assert!(wide.contains("\"polynomial\":\"s + 3\""));
    let degenerate = state_space(json!({
        "A": [[-1, 0], [0, -2]], "B": [[1, 0], [1, 1]], "C": [[1, 1], [1, 1]],
    }));
    for text in [
        hidden(),
        square,
        wide,
        degenerate,
        analysis("two-bodies", &[], &[]),
        analysis("sia-steering", &["driver"], &["cs.phi"]),
    ] {
        let Some((agrees, output)) = python(&text) else {
            println!("python3 is not installed: docs/check_certificate.py is not run");
            return;
        };
        assert!(
            agrees && output.contains("ranks, least numbers, relative degrees, multiplicities, normal rank"),
            "{output}"
        );
        let whole: Value = serde_json::from_str(&text).unwrap();
        assert!(output.contains(", zeros"), "{output}");
        let broken = vec![
            "/controllable_rank".to_string(),
            "/observable_rank".into(),
            "/min_inputs".into(),
            "/min_outputs".into(),
            "/zeros/normal_rank".into(),
            "/certificate/controllability_minor/value".into(),
            "/certificate/pencil/A/0/2".into(),
            "/certificate/inputs/number".into(),
            "/factors/0/algebraic".into(),
            "/factors/0/geometric".into(),
            "/factors/0/input_defect".into(),
            "/factors/0/output_defect".into(),
            "/factors/0/polynomial".into(),
            "/relative_degrees/table/0/0".into(),
            "/zeros/polynomial".into(),
        ];
        for path in broken {
            let mut other = whole.clone();
            let place = other.pointer_mut(&path).unwrap_or_else(|| panic!("{path}"));
            *place = match &*place {
                Value::String(text) if path.ends_with("polynomial") => json!(format!("{text} + 1")),
                Value::Null => json!(1),
                value => changed(value),
            };
            let (agrees, output) = python(&other.to_string()).unwrap();
            assert!(!agrees && output.starts_with("refused"), "{path}: {output}");
        }
    }
}

/// It follows a singular E to the state space of the certificate, and the change to the nearest system that loses a mode.
#[test]
fn the_documented_checker_follows_a_singular_e_and_distances() {
    let singular = state_space(json!({
        "E": [[1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]],
        "A": [[-1, 0, 0, 2], [0, 1, 0, 0], [1, 0, 1, 0], [0, 0, 0, 3]],
        "B": [[1, 0], [0, 1], [1, 1], [0, 1.5]],
        "C": [[1, 0, 0, 0], [0, 1, 0, 1], [1, 0, 0, 1]],
        "D": [[0, 0], [0, 1], [1, 0]],
    }));
    let plain = state_space(json!({"A": [[0.1, 1.3], [0.25, -1]], "B": [[1], [0.2]], "C": [[1, 0]]}));
    let cases = [
        (
            singular,
            "separation of the singular E",
            [
                "/descriptor/proof/left/0/0",
                "/descriptor/proof/right/2/2",
                "/descriptor/proof/pencil/A/3/2",
                "/descriptor/proof/pencil/D/1/2",
                "/descriptor/infinite_blocks/0",
                "/descriptor/finite_eigenvalues",
            ]
            .as_slice(),
        ),
        (
            plain,
            "distance, controllability, distance, observability",
            [
                "/matrix_distance/controllability/proof/action/0/0",
                "/matrix_distance/controllability/proof/rows/0/1",
                "/matrix_distance/observability/proof/rows/0/0",
            ]
            .as_slice(),
        ),
    ];
    for (text, confirmed, broken) in cases {
        let Some((agrees, output)) = python(&text) else { return };
        assert!(agrees && output.trim_end().ends_with(confirmed), "{output}");
        let whole: Value = serde_json::from_str(&text).unwrap();
        for path in broken {
            let mut other = whole.clone();
            let place = other.pointer_mut(path).unwrap_or_else(|| panic!("{path}"));
            *place = changed(place);
            let (agrees, output) = python(&other.to_string()).unwrap();
            assert!(!agrees && output.starts_with("refused"), "{path}: {output}");
        }
    }
}

/// What is called stable, stabilisable or detectable, indices, the minimal order and zeros at infinity are confirmed; every one of these words and numbers,
/// changed alone, is refused. Continuous and discrete, stable, marginal (also with a Jordan block) and unstable, with parts that are not reached or seen.
#[test]
fn the_documented_checker_decides_stability_and_indices() {
    let systems = [
        json!({"A": [[0, 1], [-2, -3]], "B": [0, 1], "C": [1, 0]}),
        json!({"A": [[0, 1], [-1, 0]], "B": [0, 1], "C": [1, 0]}),
        // (s^2 + 1)^2 with a Jordan block, beside what is stable.
        json!({"A": [[0, 1, 1, 0], [-1, 0, 0, 1], [0, 0, 0, 1], [0, 0, -1, 0]], "B": [[0, 0], [0, 0], [0, 1], [1, 0]], "C": [[1, 0, 0, 0]]}),
        json!({"A": [["1/2", 1], [0, -1]], "B": [[1], [0]], "C": [[1, 1]]}),
        json!({"A": [[-1, 0, 0], [0, 2, 0], [0, 0, -3]], "B": [1, 1, 0], "C": [0, 1, 1]}),
        json!({"A": [[0, 1], [-1, "199/100"]], "B": [0, 1], "C": [1, 0], "Ts": 0.1}),
        json!({"A": [["1/2", 1, 0], [0, "-1/3", 0], [0, 0, -1]], "B": [1, 1, 0], "C": [0, 1, 1], "Ts": 1}),
        json!({"A": [["999/1000", 1], [0, "1/5"]], "B": [0, 1], "C": [1, 0], "dt": 1}),
        json!({"A": [[1, 0], [0, -1]], "B": [1, 1], "C": [0, 1]}),
        json!({"A": [[0.0005, 10], [-10, 0.0005]], "B": [0, 1], "C": [1, 0]}),
        json!({"A": [[0, 0, 0], [1, 0, 0], [0, 0, 0]], "B": [[1, 0], [0, 0], [0, 1]], "C": [[0, 1, 0], [0, 0, 1]], "D": [[0, 0], [0, 1]]}),
    ];
    let mut verdicts = std::collections::BTreeSet::new();
    for system in systems {
        let text = state_space(system);
        let Some((agrees, output)) = python(&text) else { return };
        let all = "stable, stabilisable, detectable, indices, minimal order, zeros at infinity";
        assert!(agrees && output.contains(all), "{output}");
        let whole: Value = serde_json::from_str(&text).unwrap();
        let refused = |path: &str, value: Value| {
            let mut other = whole.clone();
            *other.pointer_mut(path).unwrap_or_else(|| panic!("{path}")) = value;
            let (agrees, output) = python(&other.to_string()).unwrap();
            assert!(!agrees && output.starts_with("refused"), "{path}: {output}");
        };
        for name in ["stable", "stabilisable", "detectable"] {
            let verdict = whole["properties"][name].as_bool().unwrap();
            verdicts.insert((name, verdict));
            refused(&format!("/properties/{name}"), json!(!verdict));
            let proof = format!("/certificate/stability/{name}");
            refused(&format!("{proof}/routh/0"), json!("7/3"));
            refused(&format!("{proof}/routh"), json!([]));
            refused(&format!("{proof}/polynomial"), json!("s^9 + 1"));
        }
        let counted = &whole["properties"]["controllability_indices"];
        assert!(!counted.as_array().unwrap().is_empty());
        refused("/properties/controllability_indices/0", json!(counted[0].as_u64().unwrap() + 1));
        refused("/properties/observability_indices/0", json!(7));
        refused("/properties/minimal_order", json!(9));
        refused("/properties/infinite_zeros", json!([8]));
        refused("/properties/input_decoupling_zeros/polynomial", json!("s + 77"));
    }
    assert_eq!(verdicts.len(), 6, "each is true once and false once: {verdicts:?}");
}

/// What is said of impulses and infinity is confirmed, and refused where it is changed.
#[test]
fn the_documented_checker_decides_at_infinity() {
    let systems = [
        json!({"E": [[1, 0, 0], [0, 0, 1], [0, 0, 0]], "A": [[-1, 0, 0], [0, 1, 0], [0, 0, 1]], "B": [[1], [0], [1]], "C": [[1, 1, 0]]}),
        json!({"E": [[1, 0], [0, 0]], "A": [[-1, 1], [0, 1]], "B": [[0], [1]], "C": [[1, 0]]}),
        json!({"E": [[1, 0, 0], [0, 0, 1], [0, 0, 0]], "A": [[2, 0, 0], [0, 1, 0], [0, 0, 1]], "B": [[1], [1], [0]], "C": [[1, 0, 0]]}),
    ];
    let mut verdicts = std::collections::BTreeSet::new();
    for system in systems {
        let text = state_space(system);
        let Some((agrees, output)) = python(&text) else { return };
        assert!(agrees && output.contains("verdicts at infinity"), "{output}");
        let whole: Value = serde_json::from_str(&text).unwrap();
        for path in [
            "/descriptor/controllability/impulse",
            "/descriptor/observability/impulse",
            "/descriptor/controllability/complete",
            "/descriptor/observability/complete",
            "/descriptor/impulse_free",
        ] {
            let mut other = whole.clone();
            let place = other.pointer_mut(path).unwrap();
            let verdict = place.as_bool().unwrap();
            verdicts.insert((path, verdict));
            *place = json!(!verdict);
            let (agrees, output) = python(&other.to_string()).unwrap();
            assert!(!agrees && output.starts_with("refused"), "{path}: {output}");
        }
    }
    assert!(verdicts.len() >= 8, "{verdicts:?}");
}
