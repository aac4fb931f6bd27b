//! Output: a folder checked before any computation, files that appear complete or not at all, and
//! standard output that may be closed early.
//!
//! [`save`] is the only way to a file. It writes beside the target, with the mode and the owner of the file that is replaced,
//! syncs the bytes to the disk and renames: at any moment either the old or the new file exists, complete. If that cannot be
//! done without a loss it reports an error: for a file that the command reads, one that is read-only, belongs to
//! another user, or has several names (hard links: renaming would leave the others with the old content, writing in place
//! could lose both). It follows a symbolic link that the user named; one in an output folder, where the command chooses the
//! names, only if it stays in the folder ([`save_in`]). Extended attributes and access lists are not carried over.

use std::borrow::Borrow;
use std::fs::{self, File, OpenOptions};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::time::Duration;

use kardan::diagnostics::Diagnostic;
use kardan_report::Page;

use crate::fault;
use crate::files::{identity, is_read, reason};
use crate::render::{note, stderr};

/// How long a pipe waits for a reader.
const PATIENCE: Duration = Duration::from_secs(5);
/// Symbolic links that lead to one another.
const LINKS: usize = 40;

/// Writes to standard output; a closed pipe (`| head -1`) is not an error.
pub fn print(text: &str) -> Result<(), Diagnostic> {
    print_bytes(text.as_bytes())
}

/// A page for standard output: as wide as its terminal, of 100 columns elsewhere.
pub fn render_text(page: &Page, origin: &str) -> String {
    let terminal = terminal_size::terminal_size_of(io::stdout());
    page.text_of_width(origin, terminal.map_or(100, |(width, _)| usize::from(width.0)))
}

/// The same in so many lines at most.
pub fn render_summary(page: &Page, origin: &str, lines: usize) -> String {
    let terminal = terminal_size::terminal_size_of(io::stdout());
    page.text_on_screen(origin, terminal.map_or(100, |(width, _)| usize::from(width.0)), lines)
}

fn print_bytes(bytes: &[u8]) -> Result<(), Diagnostic> {
    let mut out = io::stdout().lock();
    match fault::write(&mut out, bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => {
            Err(Diagnostic::error("file::unwritable", format!("cannot write to standard output: {}", reason(&error))))
        }
        _ => Ok(()),
    }
}

/// A word for a shell that means this text, whatever is in it.
pub fn quoted_for_shell(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    // A word that begins with `=` is the path of a command in zsh.
    match !text.is_empty() && !text.starts_with('=') && text.chars().all(plain) {
        true => text.into(),
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Creates the folder if missing, and checks that it is writable; removes leftovers of killed runs.
pub fn prepare_folder(path: &Path) -> Result<(), Diagnostic> {
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
    sweep(path);
    Part::create(path, None)
        .and_then(|mut part| fault::write(&mut part.file, b"kardan"))
        .map_err(|error| wrong(format!("cannot write in the output folder `{shown}`: {}", reason(&error))))?;
    Ok(())
}

/// The same for a folder whose name the command has chosen, in one that the user has named.
pub fn prepare_folder_in(folder: &Path, name: &str) -> Result<PathBuf, Diagnostic> {
    let path = folder.join(name);
    stays(folder, &path)?;
    prepare_folder(&path)?;
    Ok(path)
}

/// Rejects a path in a folder that is a symbolic link out of it, or neither a plain file nor a folder: the user did not name its target.
pub fn stays(folder: &Path, path: &Path) -> Result<(), Diagnostic> {
    let mut target = path.to_owned();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        target = folder_of(&target).join(next);
    }
    let real = |path: &Path| fs::canonicalize(path).ok();
    let inside =
        target == path || real(folder).zip(real(folder_of(&target))).is_some_and(|(own, at)| at.starts_with(own));
    if inside && fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        let message = format!("`{}` is not written: it is a pipe, a socket or a device", path.display());
        return Err(
            Diagnostic::error("file::not-regular", message).help("remove it, or name another folder with --out DIR")
        );
    }
    if inside {
        return Ok(());
    }
    let message = format!(
        "`{}` is not written: it is a symbolic link to `{}`, outside the folder `{}`",
        path.display(),
        target.display(),
        folder.display()
    );
    Err(Diagnostic::error("file::link", message).help("remove the link, or name another folder with --out DIR"))
}

/// Checks that different files can be written, before any computation; creates their folders if missing. `own` is a file that the command
/// reads and may still replace, by the last of them.
pub fn prepare_files<'a>(paths: impl IntoIterator<Item = &'a PathBuf>, own: Option<&Path>) -> Result<(), Diagnostic> {
    let paths: Vec<&PathBuf> = paths.into_iter().collect();
    let mut places = Vec::new();
    for (k, path) in paths.iter().enumerate() {
        let own = own.filter(|_| k + 1 == paths.len());
        if path.is_dir() || path.file_name().is_none() || path.as_os_str() == "-" {
            let diagnostic =
                Diagnostic::error("output::file", format!("`{}` is not the name of a file", path.display()));
            return Err(match path.to_str() {
                Some("-") => diagnostic.help("for standard output name /dev/stdout; for a file of that name write ./-"),
                _ => diagnostic.help("name the file itself, such as analysis.html"),
            });
        }
        let early = |mut problem: Diagnostic| {
            let help = problem.help.take().map_or(String::new(), |help| format!("; {help}"));
            problem.help(format!("nothing was computed yet{help}"))
        };
        let Place::File(target) = place(path, own).map_err(early)? else { continue };
        prepare_folder(folder_of(&target))
            .map_err(|problem| problem.help("nothing was computed yet; name a file in another folder"))?;
        let place =
            fs::canonicalize(folder_of(&target)).unwrap_or_default().join(target.file_name().unwrap_or_default());
        if places.contains(&place) {
            let message = format!("two results would be written to the same file, `{}`", path.display());
            return Err(Diagnostic::error("file::same", message).help("give them different names"));
        }
        places.push(place);
    }
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The target of a write.
enum Place {
    /// A plain file, existing or not, with links resolved.
    File(PathBuf),
    /// A device, a pipe or a socket: written bytes cannot be undone.
    Stream(PathBuf),
    /// The standard output or the standard error of this process.
    Standard(bool),
}

/// The target of a path, and whether it may be written; `own` is a file that the command reads and may still replace.
fn place(path: &Path, own: Option<&Path>) -> Result<Place, Diagnostic> {
    let shown = path.display();
    let refused = |code, why: String| Diagnostic::error(code, format!("`{shown}` is not written: {why}"));
    let unwritable =
        |error: io::Error| Diagnostic::error("file::unwritable", format!("cannot write `{shown}`: {}", reason(&error)));
    let mut target = path.to_owned();
    for links in 0.. {
        match target.to_str() {
            Some("/dev/stdout" | "/dev/fd/1" | "/proc/self/fd/1") => return Ok(Place::Standard(true)),
            Some("/dev/stderr" | "/dev/fd/2" | "/proc/self/fd/2") => return Ok(Place::Standard(false)),
            _ => {}
        }
        match fs::symlink_metadata(&target) {
            Ok(metadata) if metadata.file_type().is_symlink() => {
                // Links in /proc are open files: their names may be deleted or reused.
                if target.starts_with("/proc") || target.starts_with("/dev/fd") {
                    return Ok(Place::Stream(target));
                }
                let next = fs::read_link(&target).map_err(unwritable)?;
                target = folder_of(&target).join(next);
                if links >= LINKS {
                    return Err(refused("file::unwritable", "too many symbolic links in a chain".into()));
                }
            }
            Ok(metadata) if metadata.is_dir() => {
                return Err(refused("file::unwritable", "a directory of that name exists".into()));
            }
            Ok(metadata) if !metadata.is_file() => {
                if is_block_device(&metadata) {
                    return Err(refused("file::unwritable", "it is a disk".into()));
                }
                return Ok(Place::Stream(target));
            }
            Ok(metadata) => {
                if is_read(&target) && own.and_then(identity).is_none_or(|own| Some(own) != identity(&target)) {
                    return Err(refused("file::input", "this command reads it".into()).help("give it another name"));
                }
                if metadata.permissions().readonly() {
                    let help = "make it writable (`chmod u+w`), or give another name";
                    return Err(refused("file::read-only", "the file is read-only".into()).help(help));
                }
                // Renaming does not check whether the file itself is writable.
                OpenOptions::new().write(true).open(&target).map_err(unwritable)?;
                let names = names(&metadata);
                if names > 1 {
                    let why =
                        format!("the file has {names} names (hard links), and the others would keep the old content");
                    let help = "write to another name and copy it over, or remove this one first";
                    return Err(refused("file::hard-links", why).help(help));
                }
                return Ok(Place::File(target));
            }
            // If the path of the folder is not a folder, its preparation reports that.
            Err(error) if matches!(error.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
                return Ok(Place::File(target));
            }
            Err(error) => return Err(unwritable(error)),
        }
    }
    unreachable!("links are counted")
}

#[cfg(unix)]
fn is_block_device(metadata: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    metadata.file_type().is_block_device()
}

#[cfg(not(unix))]
fn is_block_device(_: &fs::Metadata) -> bool {
    false
}

#[cfg(unix)]
fn names(metadata: &fs::Metadata) -> u64 {
    use std::os::unix::fs::MetadataExt;
    metadata.nlink()
}

#[cfg(not(unix))]
fn names(_: &fs::Metadata) -> u64 {
    1
}

/// Writes a file that appears complete or not at all; replaces an existing one, unless this command reads it. A target that is not a plain
/// file is written to.
pub fn save(path: &Path, bytes: &[u8]) -> Result<(), Diagnostic> {
    save_over(path, bytes, None)
}

/// The same for a file whose name the command chose, in a folder that the user named; returns its path.
pub fn save_in(folder: &Path, name: &str, bytes: &[u8]) -> Result<PathBuf, Diagnostic> {
    let path = folder.join(name);
    stays(folder, &path)?;
    save(&path, bytes)?;
    Ok(path)
}

/// A page as Markdown or as HTML: extension and text.
pub fn shown(page: &Page, markdown: bool) -> (&'static str, String) {
    if markdown { ("md", page.markdown()) } else { ("html", page.html()) }
}

/// Reports that a file was written, and how to open it if it is a page.
pub fn note_saved_file(path: &Path) {
    let path = path.display().to_string();
    note(&format!("wrote {path}"));
    stderr(&likely_columns(&path));
}

/// How to open a written page; nothing for Markdown.
pub fn likely_columns(path: &str) -> String {
    if !path.ends_with(".html") {
        return String::new();
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| PathBuf::from(path));
    let mut address = String::from("file://");
    for byte in absolute.to_string_lossy().replace('\\', "/").bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' | b':' => {
                address.push(char::from(byte));
            }
            other => address += &format!("%{other:02X}"),
        }
    }
    format!("open it in a browser: {address}\n")
}

/// Writes a page; as Markdown if the name of the file ends so.
pub fn save_page(path: &Path, page: &Page) -> Result<(), Diagnostic> {
    let markdown = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("md"));
    save(path, shown(page, markdown).1.as_bytes())
}

/// Writes the report and further data of a command to the files that were requested, prints its results, and names the files.
pub fn deliver<P: Borrow<Page>>(
    [report, data]: [&Option<PathBuf>; 2],
    page: impl FnOnce() -> P,
    bytes: impl FnOnce(&Path) -> Result<Vec<u8>, Diagnostic>,
    printed: impl FnOnce() -> String,
    quiet: bool,
) -> Result<(), Diagnostic> {
    if let Some(path) = report {
        save_page(path, page().borrow())?;
    }
    if let Some(path) = data {
        save(path, &bytes(path)?)?;
    }
    print(&printed())?;
    report.iter().chain(data).filter(|_| !quiet).for_each(|path| note_saved_file(path));
    Ok(())
}

/// The same as [`save`] where this command reads `own` and may still replace it.
pub fn save_over(path: &Path, bytes: &[u8], own: Option<&Path>) -> Result<(), Diagnostic> {
    let saved = match place(path, own)? {
        Place::Standard(true) => return print_bytes(bytes),
        Place::Standard(false) => fault::write(&mut io::stderr().lock(), bytes),
        Place::Stream(path) => {
            open_stream(path).and_then(|mut file| fault::write(&mut file, bytes).and_then(|()| file.flush()))
        }
        Place::File(target) => replace(&target, bytes),
    };
    saved.map_err(|error| {
        Diagnostic::error("file::unwritable", format!("cannot write `{}`: {}", path.display(), reason(&error)))
    })
}

/// Opens a device or a pipe; a pipe waits for its reader, but not for ever.
fn open_stream(path: PathBuf) -> io::Result<File> {
    let (give, take) = mpsc::channel();
    std::thread::spawn(move || give.send(OpenOptions::new().append(true).open(path)));
    let unread =
        || io::Error::new(ErrorKind::TimedOut, format!("nobody reads this pipe within {} s", PATIENCE.as_secs()));
    take.recv_timeout(PATIENCE).unwrap_or_else(|_| Err(unread()))
}

/// Writes to a temporary file, syncs it to the disk, and renames it.
fn replace(target: &Path, bytes: &[u8]) -> io::Result<()> {
    let folder = folder_of(target);
    let old = fs::metadata(target).ok();
    let mut part = Part::create(folder, old.as_ref())?;
    fault::write(&mut part.file, bytes)?;
    fault::step(|| part.file.sync_all())?;
    fault::step(|| fs::rename(&part.path, target))?;
    part.renamed = true;
    fault::step(|| sync_folder(folder))
}

/// Syncs the name of a new file to the disk; some file systems do not support this.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    const UNSUPPORTED: [ErrorKind; 3] = [ErrorKind::InvalidInput, ErrorKind::Unsupported, ErrorKind::PermissionDenied];
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(error) if UNSUPPORTED.contains(&error.kind()) => Ok(()),
        result => result,
    }
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// A hidden temporary file beside the target; dropping this value removes it, unless it was renamed. While it is written it is
/// locked, which distinguishes it from a leftover of a killed run.
struct Part {
    file: File,
    path: PathBuf,
    renamed: bool,
}

impl Drop for Part {
    fn drop(&mut self) {
        if !self.renamed {
            let _ = fs::remove_file(&self.path);
        }
    }
}

impl Part {
    fn create(folder: &Path, old: Option<&fs::Metadata>) -> io::Result<Self> {
        // Each name is used once, so that the removal of a leftover cannot hit another file.
        static NUMBER: AtomicUsize = AtomicUsize::new(0);
        let process = std::process::id();
        let mut error = io::Error::from(ErrorKind::AlreadyExists);
        for _ in 0..100 {
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!(".kardan-{process}-{number}.part"));
            match fault::step(|| create_new(&path, old.is_some())) {
                Ok(file) => {
                    // Without locks no process removes leftovers.
                    let _ = file.lock();
                    let part = Self { file, path, renamed: false };
                    if !part.exists() {
                        continue; // removed as a leftover just before it was locked
                    }
                    if let Some(old) = old {
                        fault::step(|| resemble(&part.file, old))?;
                    }
                    return Ok(part);
                }
                Err(one) if one.kind() == ErrorKind::AlreadyExists => error = one,
                Err(one) => return Err(one),
            }
        }
        Err(error)
    }

    #[cfg(unix)]
    fn exists(&self) -> bool {
        use std::os::unix::fs::MetadataExt;
        let of = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
        self.file.metadata().ok().map(of) == fs::symlink_metadata(&self.path).ok().map(of)
    }

    #[cfg(not(unix))]
    fn exists(&self) -> bool {
        self.path.exists()
    }
}

/// A new file with the user's umask, or private to the user until it gets the mode of another one.
fn create_new(path: &Path, hidden: bool) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    if hidden {
        use std::os::unix::fs::OpenOptionsExt;
        options.mode(0o600);
    }
    #[cfg(not(unix))]
    let _ = hidden;
    options.open(path)
}

/// Gives a file the owner and the mode of another.
#[cfg(unix)]
fn resemble(file: &File, old: &fs::Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    let own = file.metadata()?;
    if (own.uid(), own.gid()) != (old.uid(), old.gid()) {
        fchown(file, Some(old.uid()), Some(old.gid())).map_err(|_| {
            let why =
                format!("the file belongs to user {} and group {}, and would change its owner", old.uid(), old.gid());
            io::Error::other(why)
        })?;
    }
    file.set_permissions(fs::Permissions::from_mode(old.mode() & 0o7777))
}

#[cfg(not(unix))]
fn resemble(_: &File, _: &fs::Metadata) -> io::Result<()> {
    Ok(())
}

/// Removes leftovers of killed runs for this target, if no file is prepared there.
pub fn sweep_beside(path: &Path) {
    sweep(folder_of(path));
}

/// Removes leftovers of killed runs in a folder: unlocked files with kardan's temporary names.
fn sweep(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let is_ours =
            entry.file_name().to_str().is_some_and(is_part) && entry.file_type().is_ok_and(|kind| kind.is_file());
        if is_ours && OpenOptions::new().write(true).open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// `.kardan-123-0.part`
fn is_part(name: &str) -> bool {
    let number = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    name.strip_prefix(".kardan-")
        .and_then(|name| name.strip_suffix(".part"))
        .and_then(|name| name.split_once('-'))
        .is_some_and(|(process, own)| number(process) && number(own))
}

#[cfg(test)]
#[path = "../tests/unit/output.rs"]
mod tests;
