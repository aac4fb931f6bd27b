//! Where a model comes from: a built-in one, a file or standard input; with a message for every failure.

use std::path::Path;

use kardan::diagnostics::{Diagnostic, Severity, nearest};
use kardan::model::BUILTIN;
use kardan::study::{self, Project};

use crate::args::Changes;
use crate::files;
use crate::progress::Bars;
use crate::render::{self, Failure};
use crate::source::{Origin, Source};

/// The largest file of matrices: 2000 states with all digits in A and E.
const MATRICES_LIMIT: u64 = 256 << 20;

/// The model that the user named, with the values of `--set`.
pub fn open(model: &Path, changes: &Changes, quiet: bool) -> Result<(Source, Project), Failure> {
    let mut source = read(model, quiet)?;
    let project = Project::open(source.text.as_str());
    let folder = match source.origin {
        Origin::File => model.parent().unwrap_or_else(|| Path::new("")),
        Origin::Builtin | Origin::Stdin => Path::new(""),
    };
    let named = project.files().into_iter();
    let files: Vec<_> = named.map(|name| (name.clone(), files::read_named_file(&folder.join(name)))).collect();
    let project = if files.is_empty() { project } else { project.with_files(files) };
    if changes.set.is_empty() {
        return Ok((source, project));
    }
    let (project, remarks) = project.with(&changes.set)?;
    remarks.iter().filter(|_| !quiet).for_each(|remark| render::note(remark));
    source.changed = Some(project.to_toml());
    Ok((source, project))
}

/// The same, prepared: a bar shows the progress if it takes long.
pub fn prepared(model: &Path, changes: &Changes, quiet: bool) -> Result<(Source, Project), Failure> {
    let opened = open(model, changes, quiet)?;
    let bars = Bars::new(quiet);
    opened.1.prepare_with_progress(&bars);
    bars.clear();
    Ok(opened)
}

/// The same of a model without errors, but for those that `force` overrules; shows the warnings, and returns them.
pub fn checked(
    model: &Path,
    changes: &Changes,
    force: bool,
    quiet: bool,
) -> Result<(Source, Project, Vec<Diagnostic>), Failure> {
    let (source, project) = prepared(model, changes, quiet)?;
    let mut diagnostics = project.diagnostics().to_vec();
    if force {
        study::overrule(&mut diagnostics);
    }
    if diagnostics.iter().any(|d| d.severity == Severity::Error) {
        return Err(Failure { source: Some(source), diagnostics });
    }
    render::show(Some(&source), &diagnostics);
    Ok((source, project, diagnostics))
}

/// Reads the model that the user named.
pub fn read(model: &Path, quiet: bool) -> Result<Source, Diagnostic> {
    if model.as_os_str() == "-" {
        let name = "standard input";
        return Ok(Source::new(name.into(), files::read_stdin_text(name)?, Origin::Stdin));
    }
    if let Some(builtin) = BUILTIN.iter().find(|builtin| model.as_os_str() == builtin.name) {
        let name = builtin.name.to_owned();
        // The note on which of two models is used appears only if there are two.
        let beside = [name.clone(), format!("{name}.toml")].into_iter().find(|file| Path::new(file).exists());
        if let (false, Some(file)) = (quiet, beside) {
            render::note(&format!("using the built-in model {name}; the file of that name is ./{file}"));
        }
        return Ok(Source::new(name, builtin.source.to_owned(), Origin::Builtin));
    }
    let name = model.display().to_string();
    let stem = model.file_stem().unwrap_or_default().to_string_lossy();
    let no_model = Diagnostic::error("file::not-found", format!("there is no file and no built-in model `{name}`"));
    let text = files::read_model_text(model, &name, no_model.help(builtin_hint(&stem)))?;
    Ok(Source::new(name, text, Origin::File))
}

/// Reads plain matrices, and returns their name.
pub fn read_matrices(path: &Path) -> Result<(String, Vec<u8>), Diagnostic> {
    let is_stdin = path.as_os_str() == "-";
    let name = if is_stdin { "standard input".to_owned() } else { path.display().to_string() };
    let help = "name a JSON or MAT file with the matrices, or `-` for standard input";
    let bytes = match is_stdin {
        true => files::read_stdin(&name, MATRICES_LIMIT)?,
        false => files::read_limited(path, &name, MATRICES_LIMIT, files::not_found(&name).help(help))?,
    };
    if bytes.is_empty() {
        return Err(
            Diagnostic::error("file::empty", format!("`{name}` is empty")).help("it should contain A, B, C and D")
        );
    }
    Ok((name, bytes))
}

/// Reads a text file that is not a model.
pub fn read_text(path: &Path) -> Result<String, Diagnostic> {
    let name = path.display().to_string();
    files::read_model_text(path, &name, files::not_found(&name).help("check the path"))
}

/// A hint for a name that is not that of a built-in model.
pub fn builtin_hint(name: &str) -> String {
    let all: Vec<&str> = BUILTIN.iter().map(|builtin| builtin.name).collect();
    let begin_so: Vec<&str> = all.iter().copied().filter(|builtin| builtin.starts_with(name)).collect();
    if name.chars().count() > 1 && !begin_so.is_empty() {
        return format!("built-in models that start with `{name}`: {}", begin_so.join(", "));
    }
    let list = format!("built-in models: {}", all.join(", "));
    match nearest(name, all) {
        Some(near) => format!("did you mean the built-in model `{near}`? ({list})"),
        None => list,
    }
}
