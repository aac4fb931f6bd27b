//! Only one sweep at a time writes to a folder: it locks the folder while it runs. The system releases the locks when the process ends for any reason.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::path::{Path, PathBuf};

use kardan::diagnostics::Diagnostic;
use kardan::study::Shard;

use crate::fault;
use crate::files::{name_in_folder, paths_in, reason};
use crate::output::stays;

/// The lock: exclusive for a sweep, shared for a shard.
const LOCK: &str = ".kardan-lock";

/// Locks on a folder, as long as they live.
pub struct Lock {
    folder: PathBuf,
    files: Vec<File>,
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Closing is not enough, if a process that starts at this moment has them open too.
        self.files.iter().for_each(|file| {
            let _ = file.unlock();
        });
    }
}

impl Lock {
    /// Locks the folder for a sweep, or for a shard of it: several shards may write to one folder, each once.
    pub fn take(folder: &Path, shard: Option<Shard>) -> Result<Self, Diagnostic> {
        let mut files = vec![locked(folder, LOCK, shard.is_some())?];
        if let Some(Shard { number, of }) = shard {
            files.push(locked(folder, &format!("{LOCK}-{number}-of-{of}"), false)?);
        }
        Ok(Self { folder: folder.to_owned(), files })
    }

    /// Removes the lock files, those of shards too; no other process has locked them.
    pub fn remove(self) {
        for path in paths_in(&self.folder).filter(|path| name_in_folder(path).starts_with(LOCK)) {
            let _ = fs::remove_file(path);
        }
    }
}

/// A locked file of the folder; on a file system without locks, kardan assumes no other process.
fn locked(folder: &Path, name: &str, shared: bool) -> Result<File, Diagnostic> {
    let path = folder.join(name);
    stays(folder, &path)?;
    let open = || OpenOptions::new().read(true).write(true).create(true).truncate(true).open(&path);
    let file = fault::step(open).map_err(|error| {
        let message =
            format!("cannot lock the folder `{}` by `{}`: {}", folder.display(), path.display(), reason(&error));
        Diagnostic::error("output::folder", message).help("remove that file, or name another folder with --out DIR")
    })?;
    match if shared { file.try_lock_shared() } else { file.try_lock() } {
        Err(TryLockError::WouldBlock) => {
            let message = format!("another sweep is running in the folder `{}`", folder.display());
            let help = "wait until it ends, or name another folder with --out DIR";
            Err(Diagnostic::error("output::locked", message).help(help))
        }
        Ok(()) | Err(TryLockError::Error(_)) => Ok(file),
    }
}
