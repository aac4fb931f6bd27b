//! Files that are read: plain ones only. A pipe may never end, a device has no end or no bytes, and a directory contains files.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use kardan::diagnostics::Diagnostic;
use kardan::model::{BUILTIN, FileBytes};

/// The largest model file that is read, bytes.
pub const MODEL_LIMIT: u64 = 16 << 20;

/// The kind of a path that is not a plain file.
fn other_kind(found: &Metadata) -> Option<&'static str> {
    let kind = found.file_type();
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kinds = [
            (kind.is_fifo(), "a pipe"),
            (kind.is_socket(), "a socket"),
            (kind.is_char_device() || kind.is_block_device(), "a device"),
        ];
        if let Some((_, word)) = kinds.into_iter().find(|(is_it, _)| *is_it) {
            return Some(word);
        }
    }
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => None,
        (_, true) => Some("a directory"),
        _ => Some("something else"),
    }
}

/// Rejects a path to anything but a plain file; `name` is the user's name for it. [`open`] reports a missing file.
pub fn expect_plain(path: &Path, name: &str) -> Result<(), Diagnostic> {
    let Some(kind) = fs::metadata(path).ok().as_ref().and_then(other_kind) else { return Ok(()) };
    let message = format!("`{name}` is {kind}, not a file");
    Err(match kind {
        "a directory" => Diagnostic::error("file::directory", message).help("name a file inside it"),
        _ => Diagnostic::error("file::not-regular", message).help(
            "write its output to a file first, and name that file; a model may also come from standard input: `-`",
        ),
    })
}

/// Opens a plain file.
pub fn open(path: &Path) -> io::Result<File> {
    expect_plain(path, &path.display().to_string()).map_err(|diagnostic| io::Error::other(diagnostic.message))?;
    File::open(path)
}

/// The paths in a folder; none if it cannot be read.
pub fn paths_in(folder: &Path) -> impl Iterator<Item = PathBuf> + use<> {
    fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path())
}

/// The name of a file; empty if it is not UTF-8.
pub fn name_in_folder(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap_or_default()
}

/// The bytes of a plain file.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// The text of a plain file.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(io::Error::other)
}

/// A file does not exist.
pub fn not_found(name: &str) -> Diagnostic {
    Diagnostic::error("file::not-found", format!("there is no file `{name}`"))
}

/// Reads a file; `missing` is the error if it does not exist.
pub fn read_limited(path: &Path, name: &str, limit: u64, missing: Diagnostic) -> Result<Vec<u8>, Diagnostic> {
    let unreadable = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => missing.clone(),
        _ => Diagnostic::error("file::unreadable", format!("cannot read `{name}`: {}", reason(&error))),
    };
    expect_plain(path, name)?;
    let file = open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > limit {
        return Err(too_large(name, limit));
    }
    protect(path);
    bounded(name, file, limit)
}

/// The text of a file of at most [`MODEL_LIMIT`]; `missing` is the error if it does not exist.
pub fn read_model_text(path: &Path, name: &str, missing: Diagnostic) -> Result<String, Diagnostic> {
    decode(name, &read_limited(path, name, MODEL_LIMIT, missing)?)
}

/// The bytes of a file that a model names, or the reason of the failure.
pub fn read_named_file(path: &Path) -> FileBytes {
    let name = path.display().to_string();
    let read = read_limited(path, &name, MODEL_LIMIT, not_found(&name));
    read.map(Into::into).map_err(|diagnostic| diagnostic.message)
}

/// The text of standard input.
pub fn read_stdin_text(name: &str) -> Result<String, Diagnostic> {
    decode(name, &read_stdin(name, MODEL_LIMIT)?)
}

/// The bytes of standard input, at most so many.
pub fn read_stdin(name: &str, limit: u64) -> Result<Vec<u8>, Diagnostic> {
    bounded(name, io::stdin().lock(), limit)
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

/// An error of the operating system in a few words.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file or directory".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::StorageFull => "no space left on the device".into(),
        ErrorKind::QuotaExceeded => "the disk quota is used up".into(),
        ErrorKind::FileTooLarge => "the file would be larger than the system allows".into(),
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only".into(),
        ErrorKind::NotADirectory => "a part of the path is not a directory".into(),
        ErrorKind::IsADirectory => "it is a directory".into(),
        ErrorKind::InvalidFilename => "the name is too long or not allowed there".into(),
        _ => error.to_string(),
    }
}

/// The identity of a file, independent of its name.
#[cfg(unix)]
pub type Identity = (u64, u64);
#[cfg(not(unix))]
pub type Identity = PathBuf;

#[cfg(unix)]
pub fn identity(path: &Path) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().filter(fs::Metadata::is_file).map(|metadata| (metadata.dev(), metadata.ino()))
}

#[cfg(not(unix))]
pub fn identity(path: &Path) -> Option<Identity> {
    fs::canonicalize(path).ok().filter(|path| path.is_file())
}

/// The files that this command reads, with their names.
static READ: Mutex<Vec<(Identity, PathBuf)>> = Mutex::new(Vec::new());

/// Records that this command reads a file: no output overwrites it.
pub fn protect(path: &Path) {
    let found = identity(path).map(|identity| (identity, path.to_owned()));
    READ.lock().unwrap_or_else(PoisonError::into_inner).extend(found);
}

/// The command restarts: no file has been read.
pub fn begin() {
    READ.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// The paths of the files that this command has read.
pub fn read_paths() -> Vec<PathBuf> {
    READ.lock().unwrap_or_else(PoisonError::into_inner).iter().map(|(_, path)| path.clone()).collect()
}

pub fn is_read(path: &Path) -> bool {
    let read = READ.lock().unwrap_or_else(PoisonError::into_inner);
    identity(path).is_some_and(|own| read.iter().any(|(identity, _)| *identity == own))
}

#[cfg(test)]
#[path = "../tests/unit/files.rs"]
mod tests;
