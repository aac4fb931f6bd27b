//! The order of the crates and of the modules in them, read from manifests and imports.
//!
//! Both lists are those that ARCHITECTURE.md states; a new crate or module needs a line in both.

use std::fs;
use std::path::Path;

use crate::reader::{code, crate_folder, crates, inside_name, name_at, sources};

/// The crates of the workspace that each crate may depend on. The compiler keeps a file to the dependencies of its crate; this list keeps
/// the dependencies.
const CRATES: &[(&str, &[&str])] = &[
    ("kardan-rt", &[]),
    ("kardan-native", &["rt"]),
    ("kardan-tables", &["rt"]),
    ("kardan-math", &["rt", "tables"]),
    ("kardan-expr", &["rt", "native", "math"]),
    ("kardan-results", &["rt", "math"]),
    ("kardan-mechanics", &["rt", "native", "math", "expr", "results"]),
    ("kardan-schema", &["math", "expr", "mechanics"]),
    ("kardan-elements", &["rt", "math", "expr", "results", "mechanics", "schema"]),
    ("kardan-analysis", &["rt", "math", "expr", "results", "mechanics"]),
    ("kardan-synthesis", &["rt", "math", "expr", "results", "mechanics", "schema", "analysis"]),
    ("kardan-simulate", &["rt", "native", "math", "expr", "results", "mechanics", "synthesis"]),
    ("kardan-identify", &["rt", "math", "mechanics"]),
    (
        "kardan-model",
        &[
            "rt",
            "tables",
            "math",
            "expr",
            "results",
            "mechanics",
            "schema",
            "elements",
            "analysis",
            "synthesis",
            "simulate",
        ],
    ),
    (
        "kardan",
        &[
            "rt",
            "tables",
            "math",
            "expr",
            "results",
            "mechanics",
            "schema",
            "elements",
            "analysis",
            "synthesis",
            "simulate",
            "identify",
            "model",
        ],
    ),
    ("kardan-report", &["rt", "results"]),
];

/// The modules of crates that have several, from what knows nothing to what knows everything. A file may name its own and those above it.
const LAYERS: &[(&str, &[&str])] = &[
    ("kardan-math", &["names", "num", "units"]),
    ("kardan-expr", &["expr", "plan"]),
    ("kardan-mechanics", &["equations", "program", "assemble", "reduce", "symbolic"]),
    ("kardan-schema", &["entries", "diagnostics", "file", "schema"]),
    ("kardan-elements", &["element", "signal", "block", "manoeuvre"]),
    ("kardan", &["study", "export", "project"]),
];

/// The modules at the root that a code names: `crate::x`, `crate::{x::…, y}` and enough `super::` to reach the root.
fn named(code: &str, depth: usize) -> Vec<(usize, String)> {
    let climb = "super::".repeat(depth);
    let mut out = Vec::new();
    for prefix in ["crate::", climb.as_str()] {
        if prefix.is_empty() {
            continue;
        }
        for (at, _) in code.match_indices(prefix) {
            if inside_name(code, at) {
                continue;
            }
            let line = code[..at].matches('\n').count() + 1;
            let tail = &code[at + prefix.len()..];
            if let Some(group) = tail.strip_prefix('{') {
                let mut level = 0;
                let mut expected = true;
                for (k, c) in group.char_indices() {
                    match c {
                        '{' => level += 1,
                        '}' if level == 0 => break,
                        '}' => level -= 1,
                        ',' if level == 0 => expected = true,
                        c if expected && (c.is_alphanumeric() || c == '_') => {
                            out.push((line, name_at(&group[k..])));
                            expected = false;
                        }
                        _ => {}
                    }
                }
            } else {
                out.push((line, name_at(tail)));
            }
        }
    }
    out
}

/// The layer of a file and how many `super::` lead from it to the root.
fn place(root: &Path, file: &Path) -> (String, usize) {
    let relative = file.strip_prefix(root).expect("a file of the root");
    let parts: Vec<String> = relative.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    let stem = parts[0].trim_end_matches(".rs").to_string();
    let is_module_root = parts.last().is_some_and(|name| name == "mod.rs");
    (stem, if is_module_root { parts.len() - 1 } else { parts.len() })
}

/// Every breach in one file, as `line: text`.
fn breaches(layers: &[&str], layer: &str, depth: usize, code: &str) -> Vec<String> {
    let rank = |name: &str| layers.iter().position(|layer| *layer == name);
    let own = rank(layer);
    let mut out = Vec::new();
    for (line, name) in named(code, depth) {
        if let (Some(own), Some(other)) = (own, rank(&name))
            && other > own
        {
            out.push(format!("{line}: `{layer}` names `{name}`, which is below it"));
        }
    }
    out
}

#[test]
fn a_file_names_only_its_own_layer_and_those_above() {
    let (mut found, mut names) = (Vec::new(), 0);
    for (name, layers) in LAYERS {
        let root = crate_folder(&format!("../{name}/src"));
        let mut present: Vec<String> = Vec::new();
        for file in &sources(&root) {
            let (layer, depth) = place(&root, file);
            if layer == "lib" {
                continue;
            }
            if !present.contains(&layer) {
                present.push(layer.clone());
            }
            let code = code(&fs::read_to_string(file).expect("a source"));
            names += named(&code, depth).len();
            let breaches = breaches(layers, &layer, depth, &code);
            found.extend(breaches.into_iter().map(|what| format!("{}:{what}", file.display())));
        }
        present.sort();
        let mut listed: Vec<&str> = layers.to_vec();
        listed.sort_unstable();
        assert_eq!(present, listed, "{name}");
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    assert!(names > 60, "only {names} imports were read");
}

/// The crates of this workspace among the dependencies of a manifest, without those of tests.
fn dependencies(manifest: &str) -> Vec<String> {
    let mut section = "";
    let mut out = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line.trim();
        } else if section == "[dependencies]"
            && let Some(name) = line.strip_prefix("kardan-")
        {
            out.push(name_at(name));
        }
    }
    out
}

#[test]
fn a_crate_depends_only_on_those_of_the_list() {
    for (name, allowed) in CRATES {
        let manifest = crate_folder(&format!("../{name}/Cargo.toml"));
        let found = dependencies(&fs::read_to_string(manifest).expect("a manifest"));
        let mut expected: Vec<&str> = allowed.to_vec();
        expected.sort_unstable();
        assert_eq!(found, expected, "the dependencies of {name}, in the order of the alphabet");
    }
    let listed: Vec<&str> = CRATES.iter().map(|(name, _)| *name).chain(["kardan-cli"]).collect();
    for (name, _) in crates() {
        assert!(listed.contains(&name.as_str()), "the crate {name} is not in the list");
    }
    let manifest = "[dependencies]\nkardan-a.workspace = true\nb = 1\n[dev-dependencies]\nkardan-c = 2";
    assert_eq!(dependencies(manifest), ["a"]);
}

/// What a program may build on; all other modules are marked as internal. The front page of the crate lists the same.
const PUBLIC: &[&str] = &[
    "analysis",
    "diagnostics",
    "element",
    "entries",
    "export",
    "project",
    "results",
    "schema",
    "simulate",
    "study",
    "synthesis",
    "tables",
    "units",
];

#[test]
fn the_public_surface_is_listed() {
    let text = fs::read_to_string(crate_folder("src/lib.rs")).expect("lib.rs");
    let lines: Vec<&str> = text.lines().collect();
    let name = |line: &str| {
        let path = line.strip_prefix("pub mod ").or(line.strip_prefix("pub use "))?.strip_suffix(';')?;
        path.rsplit([' ', ':']).next().map(String::from)
    };
    let mut shown: Vec<String> =
        lines.windows(2).filter(|pair| pair[0].trim() != "#[doc(hidden)]").filter_map(|pair| name(pair[1])).collect();
    shown.sort();
    assert_eq!(shown, PUBLIC);
    for name in PUBLIC {
        assert!(text.contains(&format!("[`{name}`]")), "the front page does not name `{name}`");
    }
}

#[test]
fn the_reader_of_imports_finds_what_it_must() {
    let source = "\
use crate::{num::{Matrix, Lu}, study, units::Exact};
/* use crate::report; */ // crate::export
fn f() { let x = \"crate::model\"; crate::simulate::run(super::super::element::find('\\'')); r#\"crate::num\"#; }
#[cfg(test)]
mod tests { use crate::report::html; fn g() { if true { } } }
use crate::synthesis::Law;
#[cfg(test)]
#[path = \"../tests/unit/example.rs\"]
mod example;
use mycrate::nothing;
";
    let mut names: Vec<String> = named(&code(source), 2).into_iter().map(|(_, name)| name).collect();
    names.sort();
    assert_eq!(names, ["element", "num", "simulate", "study", "synthesis", "units"]);
    let layers = ["num", "reduce", "study"];
    assert_eq!(breaches(&layers, "reduce", 1, "use crate::study;\nuse crate::num;\nuse super::study;").len(), 2);
    assert!(breaches(&layers, "study", 1, "use crate::study::x; use crate::reduce;").is_empty());
}

/// What a pure library never touches.
const IMPURE: &[&str] = &[
    "println!",
    "eprintln!",
    "print!",
    "eprint!",
    "dbg!",
    "std::fs",
    "std::env",
    "std::net",
    "std::process",
    "std::io::std",
    "std::time::Instant",
    "std::time::SystemTime",
    "std::thread::sleep",
    "unsafe",
];

#[test]
fn the_library_prints_nothing_and_touches_no_files() {
    let mut read = 0;
    for (name, src) in crates() {
        // Files and the terminal; machine code; firmware, which has a test of its own.
        if ["kardan-cli", "kardan-native", "kardan-rt"].contains(&name.as_str()) {
            continue;
        }
        for file in sources(&src) {
            read += 1;
            let code = code(&fs::read_to_string(&file).expect("a source"));
            for word in IMPURE {
                let hit = code.match_indices(word).find(|(at, _)| !inside_name(&code, *at));
                assert!(hit.is_none(), "{} uses `{word}`", file.display());
            }
        }
    }
    assert!(read > 500, "only {read} files were read");
}

/// What firmware cannot have.
const NOT_IN_FIRMWARE: &[&str] = &[
    "std::",
    "alloc",
    "Vec",
    "Box",
    "String",
    "unwrap",
    "expect",
    "panic!",
    "assert!",
    "assert_eq!",
    "unreachable!",
    "todo!",
    "unimplemented!",
    "unsafe",
];

/// Places where `[` follows a value: an index, which can panic.
fn indexed(code: &str) -> Vec<usize> {
    let bytes = code.as_bytes();
    (1..bytes.len())
        .filter(|&k| {
            bytes[k] == b'[' && (bytes[k - 1].is_ascii_alphanumeric() || matches!(bytes[k - 1], b'_' | b')' | b']'))
        })
        .map(|k| code[..k].matches('\n').count() + 1)
        .collect()
}

#[test]
fn firmware_blocks_need_no_heap_and_cannot_panic() {
    let files = sources(&crate_folder("../kardan-rt/src"));
    assert!(files.len() >= 5, "only {} files of kardan-rt were read", files.len());
    let mut no_std = false;
    for file in files {
        let code = code(&fs::read_to_string(&file).expect("a source"));
        no_std |= code.contains("#![no_std]");
        // The lints that forbid these things name them.
        let code: String =
            code.lines().filter(|line| !line.starts_with("#![")).map(|line| format!("{line}\n")).collect();
        for word in NOT_IN_FIRMWARE {
            let hit = code.match_indices(word).find(|(at, _)| !inside_name(&code, *at));
            assert!(hit.is_none(), "{} uses `{word}`", file.display());
        }
        let indexed = indexed(&code);
        assert!(indexed.is_empty(), "{} indexes in the lines {indexed:?}", file.display());
    }
    assert!(no_std, "kardan-rt is no_std");
    assert_eq!(indexed("let y = x[0] + f(x)[1];\nlet z: [f64; 2] = [1.0, 2.0]; a[i][j]"), [1, 1, 2, 2]);
}
