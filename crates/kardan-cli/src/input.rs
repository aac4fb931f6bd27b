//! Where a model comes from: a built-in one, a file or standard input; with a message for every failure.

use std::io::Read;
use std::path::Path;

use kardan::diagnostics::{Diagnostic, nearest};
use kardan::model::{BUILTIN, FileBytes};
use kardan::study::Project;

use crate::args::Changes;
use crate::files::{self, expect_plain};
use crate::output::{protect, reason};
use crate::progress::Bars;
use crate::render::{self, Failure};
use crate::source::{Origin, Source};

/// The largest model file that is read, bytes.
const LIMIT: u64 = 16 << 20;
/// The largest file of matrices: 2000 states with all digits in A and E.
const MATRICES_LIMIT: u64 = 256 << 20;

/// The model that the user named, with the values of `--set`.
pub fn open(model: &Path, changes: &Changes, quiet: bool) -> Result<(Source, Project), Failure> {
    let mut source = read(model, quiet)?;
    let project = Project::open(source.text.as_str());
    let files = project.files().into_iter().map(|name| {
        let bytes = beside(model, &source, &name);
        (name, bytes)
    });
    let files: Vec<_> = files.collect();
    let project = if files.is_empty() { project } else { project.with_files(files) };
    if changes.set.is_empty() {
        return Ok((source, project));
    }
    let (project, remarks) = project.with(&changes.set)?;
    remarks.iter().filter(|_| !quiet).for_each(|remark| render::note(remark));
    source.changed = Some(project.to_toml());
    Ok((source, project))
}

/// The bytes of a file that a model names, from the folder of the model, or the reason of the failure.
fn beside(model: &Path, source: &Source, name: &str) -> FileBytes {
    let folder = match source.origin {
        Origin::File => model.parent().unwrap_or_else(|| Path::new("")),
        Origin::Builtin | Origin::Stdin => Path::new(""),
    };
    let path = folder.join(name);
    let shown = path.display().to_string();
    let missing = |name: &str| Diagnostic::error("file::not-found", format!("there is no file `{name}`"));
    file(&path, &shown, LIMIT, &missing).map(Into::into).map_err(|diagnostic| diagnostic.message)
}

/// The same, prepared: a bar shows the progress if it takes long.
pub fn prepared(model: &Path, changes: &Changes, quiet: bool) -> Result<(Source, Project), Failure> {
    let opened = open(model, changes, quiet)?;
    let bars = Bars::new(quiet);
    opened.1.prepare_with_progress(&bars);
    bars.clear();
    Ok(opened)
}

/// Reads the model that the user named.
pub fn read(model: &Path, quiet: bool) -> Result<Source, Diagnostic> {
    if model.as_os_str() == "-" {
        let text = decode("standard input", &bounded("standard input", std::io::stdin().lock(), LIMIT)?)?;
        return Ok(Source::new("standard input".into(), text, Origin::Stdin));
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
    let no_model = |name: &str| {
        let stem = model.file_stem().unwrap_or_default().to_string_lossy();
        Diagnostic::error("file::not-found", format!("there is no file and no built-in model `{name}`"))
            .help(builtin_hint(&stem))
    };
    let text = decode(&name, &file(model, &name, LIMIT, &no_model)?)?;
    Ok(Source::new(name, text, Origin::File))
}

/// Reads plain matrices, and returns their name.
pub fn read_matrices(path: &Path) -> Result<(String, Vec<u8>), Diagnostic> {
    let (name, bytes) = if path.as_os_str() == "-" {
        let name = "standard input".to_owned();
        let bytes = bounded(&name, std::io::stdin().lock(), MATRICES_LIMIT)?;
        (name, bytes)
    } else {
        let name = path.display().to_string();
        let bytes = file(path, &name, MATRICES_LIMIT, &|name| {
            Diagnostic::error("file::not-found", format!("there is no file `{name}`"))
                .help("name a JSON or MAT file with the matrices, or `-` for standard input")
        })?;
        (name, bytes)
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
    let bytes = file(path, &name, LIMIT, &|name| {
        Diagnostic::error("file::not-found", format!("there is no file `{name}`")).help("check the path")
    })?;
    decode(&name, &bytes)
}

/// `a, b, c` of the built-in models.
pub fn builtin_names() -> String {
    BUILTIN.iter().map(|builtin| builtin.name).collect::<Vec<_>>().join(", ")
}

/// A hint for a name that is not that of a built-in model.
pub fn builtin_hint(name: &str) -> String {
    let begin_so = || BUILTIN.iter().map(|builtin| builtin.name).filter(|builtin_name| builtin_name.starts_with(name));
    if name.chars().count() > 1 && begin_so().next().is_some() {
        let list = begin_so().collect::<Vec<_>>().join(", ");
        return format!("built-in models that start with `{name}`: {list}");
    }
    let list = format!("built-in models: {}", builtin_names());
    match nearest(name, BUILTIN.iter().map(|builtin| builtin.name)) {
        Some(near) => format!("did you mean the built-in model `{near}`? ({list})"),
        None => list,
    }
}

/// Reads a file; `missing` is the error if it does not exist.
fn file(path: &Path, name: &str, limit: u64, missing: &dyn Fn(&str) -> Diagnostic) -> Result<Vec<u8>, Diagnostic> {
    let unreadable = |error: std::io::Error| match error.kind() {
        std::io::ErrorKind::NotFound => missing(name),
        _ => Diagnostic::error("file::unreadable", format!("cannot read `{name}`: {}", reason(&error))),
    };
    expect_plain(path, name)?;
    let file = files::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > limit {
        return Err(too_large(name, limit));
    }
    protect(path);
    bounded(name, file, limit)
}

/// Reads to the end, but never much more than a limit: the size of standard input is unknown.
fn bounded(name: &str, from: impl Read, limit: u64) -> Result<Vec<u8>, Diagnostic> {
    let mut bytes = Vec::new();
    from.take(limit + 1)
        .read_to_end(&mut bytes)
        .map_err(|error| Diagnostic::error("file::unreadable", format!("cannot read {name}: {}", reason(&error))))?;
    if bytes.len() as u64 > limit { Err(too_large(name, limit)) } else { Ok(bytes) }
}

fn too_large(name: &str, limit: u64) -> Diagnostic {
    let message = format!("`{name}` is larger than {} MiB, too large to be read", limit >> 20);
    Diagnostic::error("file::too-large", message).help("is this the intended file?")
}

fn decode(name: &str, bytes: &[u8]) -> Result<String, Diagnostic> {
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return Err(Diagnostic::error("file::utf-16", format!("`{name}` is UTF-16 text; kardan reads UTF-8"))
            .help("save it as UTF-8, or convert it: iconv -f UTF-16 -t UTF-8 OLD > NEW"));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = std::str::from_utf8(bytes).map_err(|error| {
        let at = error.valid_up_to();
        let line = bytes[..at].iter().filter(|&&byte| byte == b'\n').count() + 1;
        let byte = bytes[at];
        let message = format!("`{name}` is not UTF-8 text: byte 0x{byte:02X} at offset {at} (line {line})");
        Diagnostic::error("file::not-utf-8", message).help("kardan reads it as text; save it as UTF-8")
    })?;
    if text.trim().is_empty() {
        return Err(Diagnostic::error("file::empty", format!("`{name}` is empty")).help(format!(
            "a model needs at least one shaft, such as [shaft.wheel] with inertia = \"0.1 kg m^2\"; `kardan elements` \
             lists all tables, and `kardan models {} --write my.toml` gives a file to start from",
            BUILTIN.first().map_or("NAME", |builtin| builtin.name)
        )));
    }
    Ok(text.to_owned())
}

#[cfg(test)]
#[path = "../tests/unit/input.rs"]
mod tests;
