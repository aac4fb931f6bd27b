//! The output folder: checked before any computation, and without files of an earlier run beside the new ones.

use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

use kardan::diagnostics::{Diagnostic, quoted};

use crate::fault;
use crate::files::{self, reason};
use crate::output::{prepare_folder, save_in, stays};
use crate::render::note;

/// A writable folder.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    used_names: HashSet<String>,
    /// The files written there: names with sums of their bytes.
    saved_files: Vec<(String, u32)>,
}

impl Folder {
    /// Creates the folder if missing, and checks that it is writable; removes leftovers of killed runs.
    pub fn prepare(path: &Path) -> Result<Self, Diagnostic> {
        prepare_folder(path)?;
        Ok(Self { path: path.to_owned(), used_names: HashSet::new(), saved_files: Vec::new() })
    }

    /// Writes a file with a name made from `stem`, and returns its path.
    pub fn write(&mut self, stem: &str, extension: &str, bytes: &[u8]) -> Result<String, Diagnostic> {
        let name = self.name(stem, extension);
        let path = save_in(&self.path, &name, bytes)?;
        self.saved_files.push((name, sum(bytes)));
        Ok(path.display().to_string())
    }

    /// A name that is safe on any file system and not in use.
    fn name(&mut self, stem: &str, extension: &str) -> String {
        let safe = |c: char| if c.is_alphanumeric() || "-_.+=".contains(c) { c } else { '-' };
        let stem: String = stem.chars().map(safe).take(60).collect();
        let stem = stem.trim_matches('.');
        let stem = if stem.is_empty() { "unnamed" } else { stem };
        let mut name = format!("{stem}.{extension}");
        let mut number = 2;
        while !self.used_names.insert(name.to_lowercase()) {
            name = format!("{stem}-{number}.{extension}");
            number += 1;
        }
        name
    }

    /// Ends the work of a command here: files that only an earlier run wrote move to `earlier/`, so that files of
    /// two runs are not mixed. Files that were changed since stay. Returns the moved paths.
    pub fn finish(&self, command: &str) -> Result<Vec<String>, Diagnostic> {
        let list = self.path.join(LIST);
        let before = files::read_text(&list).unwrap_or_default();
        let (own, foreign_lines): (Vec<Line<'_>>, Vec<Line<'_>>) =
            before.lines().filter_map(Line::read).partition(|line| line.command == command);
        let mut gone = Vec::new();
        let is_saved = |name: &str| self.saved_files.iter().any(|(candidate, _)| candidate.eq_ignore_ascii_case(name));
        for line in own.iter().filter(|line| !is_saved(line.name)) {
            let path = self.path.join(line.name);
            let unchanged = files::read(&path).is_ok_and(|bytes| sum(&bytes) == line.sum);
            if unchanged && is_plain(&path) {
                self.put_away(line.name)?;
                gone.push(path.display().to_string());
            }
        }
        let own = self.saved_files.iter().map(|(name, sum)| Line { command, sum: *sum, name });
        let now: String = foreign_lines.into_iter().chain(own).map(|line| line.render()).collect();
        if now != before {
            save_in(&self.path, LIST, now.as_bytes())?;
        }
        Ok(gone)
    }

    fn put_away(&self, name: &str) -> Result<(), Diagnostic> {
        let (from, folder) = (self.path.join(name), self.path.join(EARLIER));
        stays(&self.path, &folder)?;
        let done = fault::step(|| fs::create_dir_all(&folder))
            .and_then(|()| fault::step(|| fs::rename(&from, folder.join(name))));
        done.map_err(|error| {
            let message = format!("cannot move `{}` of an earlier run to `{}`", from.display(), folder.display());
            Diagnostic::error("output::archive", format!("{message}: {}", reason(&error)))
                .help("the new files are complete; remove the old one, or name another folder with --out DIR")
        })
    }
}

/// Reports which files of an earlier run were moved, and where.
pub fn note_moved_files(gone: &[String], quiet: bool) {
    if let (false, Some(first)) = (quiet, gone.first()) {
        let folder = Path::new(first).with_file_name(EARLIER);
        let names = quoted(gone.iter().map(String::as_str));
        note(&format!("this run did not write {names} of an earlier run: moved to `{}`", folder.display()));
    }
}

/// The list of the files that commands have written in a folder.
const LIST: &str = ".kardan-files";
/// Where files of an earlier run go.
const EARLIER: &str = "earlier";

/// A line of the list.
struct Line<'a> {
    command: &'a str,
    sum: u32,
    name: &'a str,
}

impl<'a> Line<'a> {
    /// `run 1f3a5b7c report.html`; `None` if the line is invalid, or names a file elsewhere.
    fn read(text: &'a str) -> Option<Self> {
        let (command, rest) = text.split_once(' ')?;
        let (sum, name) = rest.split_once(' ')?;
        let plain = !name.is_empty() && !name.contains(['/', '\\']) && name != ".." && name != "." && name != LIST;
        Some(Self { command, sum: u32::from_str_radix(sum, 16).ok()?, name }).filter(|_| plain)
    }

    fn render(&self) -> String {
        format!("{} {:08x} {}\n", self.command, self.sum, self.name)
    }
}

/// A sum of bytes that differs if they do, but for one case in 2^32: words of eight bytes, each rotated in and multiplied.
fn sum(bytes: &[u8]) -> u32 {
    let mix = |sum: u64, word: u64| (sum.rotate_left(5) ^ word).wrapping_mul(0x517c_c1b7_2722_0a95);
    let (blocks, rest) = bytes.as_chunks::<8>();
    let all = blocks.iter().fold(bytes.len() as u64, |sum, word| mix(sum, u64::from_le_bytes(*word)));
    (rest.iter().fold(all, |sum, byte| mix(sum, u64::from(*byte))) >> 32) as u32
}

/// Whether it is a file itself, not a link to one.
fn is_plain(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok_and(|metadata| metadata.is_file())
}

#[cfg(test)]
#[path = "../tests/unit/folder.rs"]
mod tests;
