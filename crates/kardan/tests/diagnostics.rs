//! Bad model files: every mistake is told at once, at its place, with a reason and a hint, and nothing else is.
//!
//! Each `tests/bad/NAME.toml` says in a comment what is wrong with it; `NAME.txt` beside it is what [`study::check`] has
//! to say. `UPDATE_EXPECTED=1 cargo test -p kardan --test diagnostics` rewrites the texts; read the difference.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use kardan::diagnostics::{Diagnostic, Severity, plain};
use kardan::{model, study};

/// `study::check`, which must be quick on whatever it is given.
fn check(source: &str) -> Vec<Diagnostic> {
    let start = Instant::now();
    let found = study::check(source);
    // A hundred times what it takes on a busy machine without optimisation.
    assert!(start.elapsed() < Duration::from_secs(20), "{:?} for:\n{source}", start.elapsed());
    found
}

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
        let found = std::panic::catch_unwind(|| plain(&source, &check(&source)));
        let found = found.unwrap_or_else(|_| "panicked\n".into());
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
