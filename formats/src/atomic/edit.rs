//! A lock for changes to an existing file. Two processes that read a file, add to it and replace it would lose what one of them added.

use super::partial::{parent_of, unfinished};
use crate::files::refuse_special;
use crate::{FormatError, Result};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Time for which another process that changes the same file is waited for.
const PATIENCE: Duration = Duration::from_secs(2);
/// Time between two trials.
const PAUSE: Duration = Duration::from_millis(50);

/// The right to change a file, until it is dropped. It is a hidden file `.NAME.lock` beside it: a lock on the file itself would be in the way
/// of HDF5, which locks the files that it opens. The system releases the lock of a process that is killed.
#[derive(Debug)]
pub struct EditLock {
    file: File,
    path: PathBuf,
}

/// A target by all links, and the file that locks it.
fn place_of(target: &Path) -> std::io::Result<(PathBuf, PathBuf)> {
    let target = fs::canonicalize(target)?;
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let lock = parent_of(&target).join(format!(".{name}.lock"));
    Ok((target, lock))
}

impl EditLock {
    /// Whether this is the lock of a file.
    pub(super) fn is_of(&self, target: &Path) -> bool {
        place_of(target).is_ok_and(|(_, path)| path == self.path)
    }

    /// Take the lock of a file. It must be taken before the file is opened to read.
    ///
    /// # Errors
    /// Another process changes the file and does not end within two seconds, or an error of the file system.
    pub fn take(target: &Path) -> Result<Self> {
        let (target, path) = place_of(target).map_err(|e| FormatError::io(target, "open", e))?;
        let failed = |e| FormatError::io(&target, "lock", e);
        let begun = Instant::now();
        refuse_special(&path)?;
        loop {
            let mut options = OpenOptions::new();
            options.create(true).append(true).custom_flags(libc::O_NOFOLLOW);
            let file = options.open(&path).map_err(failed)?;
            match file.try_lock() {
                Ok(()) if is_at(&file, &path) => {
                    unfinished().insert(path.clone());
                    return Ok(Self { file, path });
                }
                // The process that had the lock has removed its file.
                Ok(()) => {}
                Err(TryLockError::WouldBlock) if begun.elapsed() < PATIENCE => std::thread::sleep(PAUSE),
                Err(TryLockError::WouldBlock) => return Err(FormatError::InUse { path: target }),
                Err(TryLockError::Error(e)) => return Err(failed(e)),
            }
        }
    }
}

/// Whether an open file is the one that its path leads to.
fn is_at(file: &File, path: &Path) -> bool {
    let place = |meta: &fs::Metadata| (meta.dev(), meta.ino());
    matches!((file.metadata(), fs::metadata(path)), (Ok(open), Ok(found)) if place(&open) == place(&found))
}

impl Drop for EditLock {
    fn drop(&mut self) {
        let mut all = unfinished();
        // The file is removed while the lock is held, so that nobody else can hold it. A file that stays behind does no harm.
        let _ = fs::remove_file(&self.path);
        all.remove(&self.path);
        // A child process may hold a copy of the file, so that closing it would not be enough.
        let _ = self.file.unlock();
    }
}
