//! The model stored beside rows of a sweep, to report later what differs.

use std::path::{Path, PathBuf};

use kardan::diagnostics::Diagnostic;
use kardan::project::Project;
use kardan::study::swept_model;

use crate::files;
use crate::output::save_in;

/// The name of its file.
const MODEL: &str = "model-";

/// The model stored beside rows of this sweep.
pub fn stored_model(folder: &Path, identity: &str) -> Option<String> {
    files::read_text(&path_of_model(folder, identity)).ok()
}

/// Where the model of rows is stored.
pub fn path_of_model(folder: &Path, identity: &str) -> PathBuf {
    folder.join(name_of_model(identity))
}

fn name_of_model(identity: &str) -> String {
    format!("{MODEL}{}.toml", swept_model(identity).unwrap_or_default())
}

/// Models that are stored in a folder.
pub fn models_of(folder: &Path) -> Vec<PathBuf> {
    let is_stored = |path: &PathBuf| {
        let name = files::name_in_folder(path);
        let number = name.strip_prefix(MODEL).and_then(|rest| rest.strip_suffix(".toml")).unwrap_or_default();
        number.len() == 16 && number.bytes().all(|digit| digit.is_ascii_hexdigit())
    };
    files::paths_in(folder).filter(is_stored).collect()
}

/// Stores the model with the changes of `--set`, so that kardan can report differences later.
pub fn store_model(folder: &Path, project: &Project, identity: &str) -> Result<(), Diagnostic> {
    let text = project.to_toml();
    let is_current = files::read(&path_of_model(folder, identity)).is_ok_and(|bytes| bytes == text.as_bytes());
    if is_current { Ok(()) } else { save_in(folder, &name_of_model(identity), text.as_bytes()).map(|_| ()) }
}
