//! Where results go: a folder that was tried before anything is computed, files that appear whole or not at all, and
//! standard output that may be closed early.

use std::collections::HashSet;
use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use kardan::diagnostics::Diagnostic;

/// Writes to standard output; a reader who has gone away (`| head -1`) is no error.
pub fn print(text: &str) -> Result<(), Diagnostic> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Diagnostic::error("file::unwritable", format!("cannot write to standard output: {}", reason(&error))))
        }
        _ => Ok(()),
    }
}

/// An error of the operating system in a few words.
pub fn reason(error: &io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file or directory".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::StorageFull => "no space left on the device".into(),
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only".into(),
        ErrorKind::NotADirectory => "a part of the path is not a directory".into(),
        _ => error.to_string(),
    }
}

/// A folder known to take files.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    taken: HashSet<String>,
}

impl Folder {
    /// Makes the folder if it is not there, and tries to write in it.
    pub fn prepare(path: &Path) -> Result<Self, Diagnostic> {
        let shown = path.display();
        let wrong = |message: String| {
            Diagnostic::error("output::folder", message)
                .help("nothing was computed yet; name another folder with --out DIR")
        };
        match fs::metadata(path) {
            Ok(metadata) if !metadata.is_dir() => {
                return Err(wrong(format!("the output folder `{shown}` exists already and is a file")));
            }
            Ok(_) => {}
            Err(_) => fs::create_dir_all(path)
                .map_err(|error| wrong(format!("cannot create the output folder `{shown}`: {}", reason(&error))))?,
        }
        let probe = temporary(path, "probe", b"kardan")
            .map_err(|error| wrong(format!("cannot write in the output folder `{shown}`: {}", reason(&error))))?;
        let _ = fs::remove_file(probe);
        Ok(Self { path: path.to_owned(), taken: HashSet::new() })
    }

    /// Writes a file whose name is made from `stem`, and gives its path.
    pub fn write(&mut self, stem: &str, extension: &str, bytes: &[u8]) -> Result<String, Diagnostic> {
        let name = self.name(stem, extension);
        let path = self.path.join(name);
        save(&path, bytes)?;
        Ok(path.display().to_string())
    }

    /// A name that is safe on any file system and was not given before.
    fn name(&mut self, stem: &str, extension: &str) -> String {
        let safe = |c: char| if c.is_alphanumeric() || "-_.+=".contains(c) { c } else { '-' };
        let stem: String = stem.chars().map(safe).take(60).collect();
        let stem = stem.trim_matches('.');
        let stem = if stem.is_empty() { "unnamed" } else { stem };
        let mut name = format!("{stem}.{extension}");
        let mut number = 2;
        while !self.taken.insert(name.to_lowercase()) {
            name = format!("{stem}-{number}.{extension}");
            number += 1;
        }
        name
    }
}

/// Says whether a file can be written there, before anything is computed; makes its folder if that is not there.
pub fn prepare_file(path: &Path) -> Result<(), Diagnostic> {
    if path.is_dir() || path.file_name().is_none() {
        return Err(Diagnostic::error("output::file", format!("`{}` is not the name of a file", path.display()))
            .help("name the file itself, such as analysis.html"));
    }
    if is_special(path) {
        return Ok(());
    }
    Folder::prepare(folder_of(path)).map(|_| ()).map_err(|problem| problem.help("nothing was computed yet"))
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether something other than a plain file is there: a device, a pipe, a link.
fn is_special(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|there| !there.is_file())
}

/// Writes a file that appears whole or not at all; one that exists is replaced, what is no plain file is written to.
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    let folder = folder_of(path);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let written = if is_special(path) {
        OpenOptions::new()
            .write(true)
            .truncate(true)
            .open(path)
            .and_then(|mut file| file.write_all(bytes).and_then(|()| file.flush()))
    } else {
        temporary(folder, &name, bytes).and_then(|part| {
            fs::rename(&part, path).inspect_err(|_| {
                let _ = fs::remove_file(&part);
            })
        })
    };
    written.map_err(|error| {
        Diagnostic::error("file::unwritable", format!("cannot write `{}`: {}", path.display(), reason(&error)))
    })
}

/// Writes a hidden file beside where the real one will be.
fn temporary(folder: &Path, name: &str, bytes: &[u8]) -> io::Result<PathBuf> {
    let process = std::process::id();
    let mut attempt = 0;
    loop {
        let path = folder.join(format!(".{name}.{process}-{attempt}.part"));
        match OpenOptions::new().write(true).create_new(true).open(&path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && attempt < 100 => attempt += 1,
            Err(error) => return Err(error),
            Ok(mut file) => {
                return file.write_all(bytes).and_then(|()| file.flush()).map(|()| path.clone()).inspect_err(|_| {
                    let _ = fs::remove_file(&path);
                });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_safe_and_different() {
        let mut folder = Folder { path: PathBuf::new(), taken: HashSet::new() };
        let names = ["β=10°", "../../etc/passwd", "", "..", "A", "a", "a-2"].map(|stem| folder.name(stem, "csv"));
        let expected =
            ["β=10-.csv", "-..-etc-passwd.csv", "unnamed.csv", "unnamed-2.csv", "A.csv", "a-2.csv", "a-2-2.csv"];
        assert_eq!(names, expected);
        assert!(folder.name(&"ä".repeat(500), "csv").len() < 200);
    }
}
