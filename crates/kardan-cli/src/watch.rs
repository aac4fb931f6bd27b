//! `--watch`: repeats a command whenever a file that it reads has changed.

use std::fs;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::{Duration, SystemTime};

use kardan::diagnostics::Diagnostic;
use kardan::model::builtin;

use crate::exit::exit_code;
use crate::files::{begin, read_paths};
use crate::render::note;
use crate::stop;

/// Polling interval of the files.
const PAUSE: Duration = Duration::from_millis(100);

/// Runs the command, and again after each change of its input files, until a signal; returns the last exit code.
pub fn again_and_again(model: &Path, quiet: bool, json: bool, mut work: impl FnMut() -> u8) -> u8 {
    let name = model.display();
    let what = match model.to_str() {
        Some("-") => Some("standard input is read once: `--watch` cannot watch it".to_string()),
        Some(name) if builtin(name).is_some() => Some(format!("the built-in model `{name}` does not change")),
        _ => None,
    };
    if let Some(what) = what {
        let help = "save a model as a file first: kardan models sia-steering --write my.toml";
        return exit_code(Err(Diagnostic::error("arguments::watch", what).help(help).into()), json);
    }
    loop {
        // Taken before the work, so that no change during it is missed.
        let before = |paths: &[PathBuf]| paths.iter().map(|path| state(path)).collect::<Vec<_>>();
        let model = vec![model.to_owned()];
        let model_before = before(&model);
        begin();
        let code = work();
        stop::computing(false);
        let mut paths = read_paths();
        paths.sort();
        paths.dedup();
        paths.retain(|path| *path != model[0]);
        let paths_before = before(&paths);
        if !quiet {
            note(&format!("waiting until `{name}` changes; Ctrl-C ends"));
        }
        loop {
            if stop::reason().is_some() {
                return code;
            }
            thread::sleep(PAUSE);
            if before(&model) != model_before || before(&paths) != paths_before {
                break;
            }
        }
        wait_until_unchanged(&model, &paths);
        stop::computing(true);
    }
}

/// The properties that change when a file is written; `None` if it does not exist.
fn state(path: &Path) -> Option<(u64, SystemTime)> {
    let metadata = fs::metadata(path).ok()?;
    Some((metadata.len(), metadata.modified().ok()?))
}

/// Waits until the files stop changing: editors write in steps.
fn wait_until_unchanged(model: &[PathBuf], paths: &[PathBuf]) {
    let now = || model.iter().chain(paths).map(|path| state(path)).collect::<Vec<_>>();
    for _ in 0..20 {
        let before = now();
        thread::sleep(PAUSE / 2);
        if now() == before && before.iter().all(Option::is_some) {
            return;
        }
    }
}
