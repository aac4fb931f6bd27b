//! Files that are read: plain ones only. A pipe may never end, a device has no end or no bytes, and a directory contains files.

use std::fs::{self, File, Metadata};
use std::io;
use std::path::Path;

use kardan::diagnostics::Diagnostic;

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

/// The bytes of a plain file.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    io::Read::read_to_end(&mut open(path)?, &mut bytes)?;
    Ok(bytes)
}

/// The text of a plain file.
pub fn read_text(path: &Path) -> io::Result<String> {
    String::from_utf8(read(path)?).map_err(io::Error::other)
}
