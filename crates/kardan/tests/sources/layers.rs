//! The order of the layers, read from the imports of the sources.
//!
//! A file may name its own folder and the layers above it in [`LAYERS`], nothing else. The list is the one that
//! ARCHITECTURE.md states; a new layer needs a line in both.

use std::fs;
use std::path::Path;

use crate::reader::{code, crate_folder, inside_name, name_at, sources};

/// From what knows nothing to what knows everything. A layer is a folder or a file of `src`.
///
/// `synthesis` stands above `simulate` because a run takes a designed law as given (`synthesis::Law`), and above `model`
/// because the keys of a `[control.<name>]` table come from the registry of laws.
const LAYERS: &[&str] = &[
    "num",         // numbers and small matrices; no mechanics
    "names",       // names in sentences
    "units",       // exact quantities
    "expr",        // exact expressions
    "plan",        // expressions as lists of operations
    "entries",     // what a model is written as, with places
    "diagnostics", // mistakes with a place
    "file",        // the syntax of a file
    "schema",      // the keys of a table
    "equations",   // terms, data only
    "program",     // what blocks compute, data only
    "results",     // what a study gives, data only
    "element",     // named handfuls of terms, one registry
    "signal",      // functions of time by name, one registry
    "block",       // what a program of signals is made of, one registry
    "manoeuvre",   // what steering engineers drive, one registry
    "assemble",    // terms to matrices
    "reduce",      // constraints out of the equations
    "symbolic",    // the same in the names of values
    "analysis",    // structure, modes, zeros
    "synthesis",   // control laws, one registry
    "simulate",    // runs of the closed loop
    "identify",    // coefficients from measured motions
    "model",       // entries as typed tables
    "study",       // what a file asks for → results
    "export",      // results → data files
    "project",     // the names that a program begins with
];

/// Additional borders: what a layer does not know although it stands above it.
const UNKNOWN: &[(&str, &[&str])] = &[
    ("simulate", &["element", "schema", "diagnostics", "signal", "block", "analysis"]),
    ("identify", &["element", "schema", "diagnostics", "analysis", "synthesis", "simulate"]),
    ("reduce", &["element", "schema", "diagnostics", "signal", "block"]),
    ("assemble", &["element", "schema", "diagnostics"]),
    ("symbolic", &["element", "schema", "diagnostics", "signal", "block"]),
    ("export", &["model", "study", "simulate", "synthesis", "analysis", "reduce", "assemble", "element"]),
];

/// The layers that a code names: `crate::x`, `kardan::x`, `crate::{x::…, y}` and enough `super::` to reach the root.
fn named(code: &str, depth: usize) -> Vec<(usize, String)> {
    let climb = "super::".repeat(depth);
    let mut out = Vec::new();
    for prefix in ["crate::", "kardan::", climb.as_str()] {
        if prefix.is_empty() {
            continue;
        }
        for (at, _) in code.match_indices(prefix) {
            if inside_name(code, at) {
                continue;
            }
            let line = code[..at].matches('\n').count() + 1;
            let rest = &code[at + prefix.len()..];
            if let Some(group) = rest.strip_prefix('{') {
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
                out.push((line, name_at(rest)));
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
fn breaches(layer: &str, depth: usize, code: &str) -> Vec<String> {
    let rank = |name: &str| LAYERS.iter().position(|layer| *layer == name);
    let own = rank(layer);
    let mut out = Vec::new();
    for (line, name) in named(code, depth) {
        if name == layer {
            continue;
        }
        match (own, rank(&name)) {
            (_, None) => out.push(format!("{line}: `{name}` is no layer")),
            (Some(own), Some(other)) if other > own => {
                out.push(format!("{line}: `{layer}` names `{name}`, which is below it"))
            }
            _ if UNKNOWN.iter().any(|(l, not)| *l == layer && not.contains(&name.as_str())) => {
                out.push(format!("{line}: `{layer}` must not know `{name}`"));
            }
            _ => {}
        }
    }
    out
}

#[test]
fn a_file_names_only_its_own_layer_and_those_above() {
    let root = crate_folder("src");
    let files = sources(&root);
    assert!(files.len() > 20, "only {} files were read", files.len());
    let mut found = Vec::new();
    let mut names = 0;
    let mut seen: Vec<String> = Vec::new();
    for file in &files {
        let (layer, depth) = place(&root, file);
        if layer == "lib" {
            continue;
        }
        if !LAYERS.contains(&layer.as_str()) {
            found.push(format!("{}: `{layer}` is not in the list of layers", file.display()));
            continue;
        }
        if !seen.contains(&layer) {
            seen.push(layer.clone());
        }
        let text = fs::read_to_string(file).expect("a source");
        // A file of tests that its folder includes under cfg(test).
        if file.file_stem().is_some_and(|stem| stem == "tests" || stem == "example") {
            continue;
        }
        let code = code(&text);
        names += named(&code, depth).len();
        found.extend(breaches(&layer, depth, &code).into_iter().map(|what| format!("{}:{what}", file.display())));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
    for layer in LAYERS {
        assert!(seen.iter().any(|name| name == layer), "the layer `{layer}` does not exist");
    }
    assert!(names > 60, "only {names} imports were read");
}

#[test]
fn the_root_lists_the_layers() {
    let text = code(&fs::read_to_string(crate_folder("src/lib.rs")).expect("lib.rs"));
    let mut modules: Vec<String> =
        text.lines().filter_map(|line| line.trim().strip_prefix("pub mod ")).map(name_at).collect();
    let mut layers: Vec<String> = LAYERS.iter().map(|layer| layer.to_string()).collect();
    modules.sort();
    layers.sort();
    assert_eq!(modules, layers);
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
    "units",
];

#[test]
fn the_public_surface_is_listed() {
    let text = fs::read_to_string(crate_folder("src/lib.rs")).expect("lib.rs");
    let lines: Vec<&str> = text.lines().collect();
    let shown: Vec<String> = lines
        .windows(2)
        .filter(|pair| pair[0].trim() != "#[doc(hidden)]")
        .filter_map(|pair| pair[1].strip_prefix("pub mod ").map(name_at))
        .collect();
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
fn f() { let x = \"crate::model\"; crate::simulate::run(super::super::element::find('\\'')); r#\"kardan::num\"#; }
#[cfg(test)]
mod tests { use crate::report::html; fn g() { if true { } } }
use kardan::synthesis::Law;
#[cfg(test)]
mod example;
use mycrate::nothing;
";
    let mut names: Vec<String> = named(&code(source), 2).into_iter().map(|(_, name)| name).collect();
    names.sort();
    assert_eq!(names, ["element", "num", "simulate", "study", "synthesis", "units"]);
    let below =
        breaches("reduce", 1, "use crate::study;\nuse crate::num;\nuse crate::element::X;\nuse crate::nonsense;");
    assert_eq!(below.len(), 3, "{below:?}");
    assert!(breaches("study", 1, "use crate::study::x; use crate::model;").is_empty());
}

#[test]
fn the_report_knows_results_alone() {
    let files = sources(&crate_folder("../kardan-report/src"));
    let mut known = 0;
    for file in &files {
        let code = code(&fs::read_to_string(file).expect("a source"));
        let after = |(at, name): (usize, &str)| name_at(&code[at + name.len()..]);
        let names: Vec<String> =
            code.match_indices("kardan::").filter(|(at, _)| !inside_name(&code, *at)).map(after).collect();
        known += names.len();
        assert!(names.iter().all(|name| name == "results"), "{} knows {names:?}", file.display());
    }
    assert!(known > 10, "only {known} imports were read");
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
    let files = sources(&crate_folder("src"));
    let tables = sources(&crate_folder("../kardan-tables/src"));
    let report = sources(&crate_folder("../kardan-report/src"));
    assert!(files.len() > 20 && tables.len() > 10 && report.len() > 10);
    for file in files.into_iter().chain(tables).chain(report) {
        let code = code(&fs::read_to_string(&file).expect("a source"));
        for word in IMPURE {
            let hit = code.match_indices(word).find(|(at, _)| !inside_name(&code, *at));
            assert!(hit.is_none(), "{} uses `{word}`", file.display());
        }
    }
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
