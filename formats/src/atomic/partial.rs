//! Hidden folders in which outputs grow until they are complete.
//!
//! An output is written to a folder `.NAME.RANDOM.partial` beside its final name. The folder has a random name, so that what a killed process
//! left behind cannot block a later one. Only its owner may look into it. It is locked as long as the process that writes it lives, so that
//! another process can tell a leftover from an output that is being written. The folder is locked and not the file, because HDF5 locks the
//! files that it writes itself.

use crate::{FormatError, Result};
use std::cell::RefCell;
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// End of the name of every hidden folder.
const ENDING: &str = ".partial";
/// Number of random letters in the name of a hidden folder.
const LETTERS: usize = 12;
/// Folder inside of a hidden folder for an old output, where a new folder cannot take its place in one step.
const REPLACED: &str = "replaced";

/// What this process has begun and not completed: hidden folders and lock files, as absolute paths.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

thread_local! {
    /// Messages for the user that were not taken yet.
    static NOTES: RefCell<Vec<String>> = const { RefCell::new(Vec::new()) };
}

fn tell(note: String) {
    NOTES.with_borrow_mut(|notes| notes.push(note));
}

/// What the user should know about the outputs that this thread has begun: what killed runs had left.
#[must_use]
pub fn take_notes() -> Vec<String> {
    NOTES.take()
}

/// Put these notes in the place of those of this thread, which are returned.
pub(super) fn replace_notes(notes: Vec<String>) -> Vec<String> {
    NOTES.replace(notes)
}

/// Hold back the removal of unfinished outputs by a signal, as long as the guard lives.
pub(super) fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Remove all that this process has begun and not completed. To be called by the thread that ends the process after a signal: outputs that are
/// being renamed are completed first, and afterwards no output gets its name and none can be begun.
pub fn remove_unfinished() {
    let all = unfinished();
    for path in all.iter() {
        // The process is still writing: a file may appear in the folder while it is being removed.
        for _ in 0..100 {
            let removed = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
            if removed.is_ok() || !path.exists() {
                break;
            }
        }
    }
    // The lock stays closed until the process ends.
    std::mem::forget(all);
}

/// True where a path lies in a hidden folder of this process. What is written there appears with that folder.
pub(super) fn is_inside_of_one(path: &Path) -> bool {
    let Ok(path) = std::path::absolute(path) else { return false };
    unfinished().iter().any(|folder| path.starts_with(folder))
}

/// A hidden folder for an output. It is removed with all that is in it when it is dropped.
#[derive(Debug)]
pub(super) struct Partial {
    folder: PathBuf,
    /// The absolute path, as it is listed with all that is unfinished.
    full: PathBuf,
    /// Keeps the lock. `None` where the file system has no locks.
    lock: Option<File>,
}

impl Partial {
    /// A hidden folder beside `target`.
    pub(super) fn beside(target: &Path) -> Result<Self> {
        let Some(name) = target.file_name() else {
            return Err(FormatError::not_a(target, "the name of an output", "a path without a name"));
        };
        let mut builder = tempfile::Builder::new();
        let prefix = prefix(&name.to_string_lossy());
        builder.prefix(&prefix).suffix(ENDING).rand_bytes(LETTERS);
        loop {
            let mut all = unfinished();
            let made = builder.tempdir_in(parent_of(target)).map_err(|e| FormatError::io(target, "create", explain(target, e)))?.keep();
            // A relative path stays one: the folder in which the program works may have a name that is no text. It begins with `./`, because
            // casacore takes the dot of a hidden name at the beginning of a path for the folder in which the program works.
            let folder = parent_of(target).join(made.file_name().unwrap_or_default());
            let full = std::path::absolute(&folder).map_err(|e| FormatError::io(target, "create", e))?;
            let lock = lock(&folder);
            // Another process may have taken the new folder for a leftover before it was locked.
            if matches!(lock, Lock::Taken) || !folder.exists() {
                continue;
            }
            all.insert(full.clone());
            return Ok(Self { folder, full, lock: if let Lock::Held(file) = lock { Some(file) } else { None } });
        }
    }

    /// The place of a file or folder in the hidden folder.
    pub(super) fn place(&self, name: impl AsRef<Path>) -> PathBuf {
        self.folder.join(name)
    }

    /// The place to which an old output moves while a new one takes its name. A leftover that holds it is restored, see [`clear`].
    pub(super) fn place_of_replaced(&self, target: &Path) -> io::Result<PathBuf> {
        let folder = self.folder.join(REPLACED);
        fs::create_dir_all(&folder)?;
        Ok(folder.join(target.file_name().unwrap_or_default()))
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        let mut all = unfinished();
        // A failure cannot be reported here. The folder is hidden, and the next run finds it.
        let _ = fs::remove_dir_all(&self.folder);
        all.remove(&self.full);
        if let Some(lock) = self.lock.take() {
            // A child process may hold a copy of the file, so that closing it would not be enough.
            let _ = lock.unlock();
        }
    }
}

enum Lock {
    Held(File),
    Taken,
    Unknown,
}

fn lock(folder: &Path) -> Lock {
    match File::open(folder).map(|file| (file.try_lock(), file)) {
        Ok((Ok(()), file)) => Lock::Held(file),
        Ok((Err(fs::TryLockError::WouldBlock), _)) => Lock::Taken,
        _ => Lock::Unknown,
    }
}

/// Remove the hidden folders that killed processes have left of this output, and tell so. An old output that such a process had moved away
/// gets its name back.
pub(super) fn clear(target: &Path) {
    if is_inside_of_one(target) {
        return;
    }
    let Some(name) = target.file_name().map(|n| n.to_string_lossy().into_owned()) else { return };
    let prefix = prefix(&name);
    // A folder that cannot be listed is met again when the output is created.
    let Ok(entries) = fs::read_dir(parent_of(target)) else { return };
    for entry in entries.flatten().filter(|e| is_of(&e.file_name().to_string_lossy(), &prefix)) {
        let folder = entry.path();
        let own = std::path::absolute(&folder).is_ok_and(|p| unfinished().contains(&p));
        if own || !entry.file_type().is_ok_and(|t| t.is_dir()) {
            continue;
        }
        let Lock::Held(_lock) = lock(&folder) else { continue };
        let old = folder.join(REPLACED).join(target.file_name().unwrap_or_default());
        if old.exists() && fs::symlink_metadata(target).is_err() {
            match fs::rename(&old, target) {
                Ok(()) => tell(format!("{}: a run that was killed had moved it away; it is back", target.display())),
                Err(_) => continue,
            }
        }
        if fs::remove_dir_all(&folder).is_ok() {
            tell(format!("{}: removed, a run that was killed had left it", folder.display()));
        }
    }
}

/// Beginning of the names of the hidden folders of an output. A long name is cut, because most file systems take 255 bytes.
fn prefix(name: &str) -> String {
    let end = (0..=name.len().min(120)).rev().find(|k| name.is_char_boundary(*k)).unwrap_or(0);
    format!(".{}.", &name[..end])
}

fn is_of(name: &str, prefix: &str) -> bool {
    let letters = name.strip_prefix(prefix).and_then(|rest| rest.strip_suffix(ENDING));
    letters.is_some_and(|l| l.len() == LETTERS && l.bytes().all(|b| b.is_ascii_alphanumeric()))
}

/// Directory of an output: `.` for a name without a directory.
pub(super) fn parent_of(target: &Path) -> &Path {
    target.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// An error that says that the directory is missing, not the file.
pub(super) fn explain(target: &Path, error: io::Error) -> io::Error {
    let folder = parent_of(target);
    let text = match error.kind() {
        io::ErrorKind::NotFound if !folder.is_dir() => format!("there is no directory {}", folder.display()),
        io::ErrorKind::PermissionDenied => format!("this user may not write to the directory {}", folder.display()),
        io::ErrorKind::InvalidFilename => "the name is too long for the file system".into(),
        kind => format!("{kind}"),
    };
    io::Error::new(error.kind(), text)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// casacore reads `.x.ms.partial/x.ms` as `x.ms.partial/x.ms`.
    #[test]
    fn the_hidden_folder_of_a_relative_path_begins_with_a_dot_and_a_slash() {
        let partial = Partial::beside(Path::new("hidden-name.ms")).unwrap();
        let place = partial.place("hidden-name.ms");
        assert!(place.to_str().unwrap().starts_with("./.hidden-name.ms."), "{place:?}");
    }
}
