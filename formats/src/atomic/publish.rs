//! Gives finished outputs their final names.

use super::list::FileList;
use super::partial::{Partial, parent_of};
use crate::{FormatError, Result};
use rustix::fs::{CWD, RenameFlags, renameat_with};
use std::fs::{self, File, Permissions};
use std::io;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::JoinHandle;

/// A finished file or folder that waits for its name.
#[derive(Debug)]
pub(super) struct Finished {
    /// The hidden folder that holds it.
    pub(super) partial: Arc<Partial>,
    /// Its place in the hidden folder.
    pub(super) from: PathBuf,
    /// Its final name.
    pub(super) target: PathBuf,
    /// Whether an existing output is replaced.
    pub(super) overwrite: bool,
    /// For a folder of results: who writes it. Files of others in the old folder are kept.
    pub(super) writer: Option<&'static str>,
    /// The flushing of a file to the disk, which goes on while the next output is made.
    pub(super) flush: Option<Flush>,
}

/// The flushing of a file to the disk, on a thread of its own.
#[derive(Debug)]
pub(super) struct Flush(Option<JoinHandle<io::Result<()>>>);

impl Flush {
    /// Begin. Where no thread can be started, the file is flushed now.
    pub(super) fn begin(file: File) -> io::Result<Self> {
        let own = file.try_clone()?;
        match std::thread::Builder::new().name("flush".into()).spawn(move || own.sync_all()) {
            Ok(thread) => Ok(Self(Some(thread))),
            Err(_) => file.sync_all().map(|()| Self(None)),
        }
    }

    /// Wait until the file is on the disk.
    fn end(self) -> io::Result<()> {
        self.0.map_or(Ok(()), |thread| thread.join().unwrap_or_else(|_| Err(io::Error::other("the thread that flushes has failed"))))
    }
}

impl Finished {
    /// Wait until the bytes are on the disk.
    ///
    /// # Errors
    /// An error of the file system; a full disk often shows here.
    pub(super) fn flushed(&mut self) -> Result<()> {
        self.flush.take().map_or(Ok(()), Flush::end).map_err(|e| FormatError::io(&self.target, "flush to disk", e))
    }

    /// Refuse what can be known to fail, before the first of several outputs gets its name.
    pub(super) fn check(&self) -> Result<()> {
        refuse_existing(&self.target, self.overwrite)?;
        self.keep_files_of_others()
    }

    /// Give the output its name. With `private`, others than its owner may not read it.
    pub(super) fn publish(&self, private: bool) -> Result<()> {
        let (from, target) = (&self.from, &self.target);
        let failed = |e| FormatError::io(target, "rename the finished output to", e);
        restrict(from, target, private).map_err(|e| FormatError::io(target, "set the permissions of", e))?;
        if !self.overwrite {
            return rename_to_a_new_name(from, target).map_err(|e| match e.kind() {
                io::ErrorKind::AlreadyExists => FormatError::Exists { path: target.clone() },
                _ => failed(e),
            });
        }
        if from.is_dir() && target.is_dir() {
            return self.exchange().map_err(failed);
        }
        fs::rename(from, target).map_err(failed)
    }

    /// Exchange the new folder with the old one in one step, so that there is a whole folder under the name at any time. Where the file system
    /// cannot do that, the old folder moves away first. It comes back at the next start if the process is killed between the two steps.
    fn exchange(&self) -> io::Result<()> {
        if renameat_with(CWD, &self.from, CWD, &self.target, RenameFlags::EXCHANGE).is_ok() {
            return Ok(());
        }
        let old = self.partial.place_of_replaced(&self.target)?;
        fs::rename(&self.target, &old)?;
        fs::rename(&self.from, &self.target).inspect_err(|_| {
            // The error that is reported is the first one. If this fails too, the next start moves the old folder back.
            let _ = fs::rename(&old, &self.target);
        })
    }

    /// Put the files of others in the old folder into the new one. They are linked and not moved: they stay where they are until the folders
    /// are exchanged.
    fn keep_files_of_others(&self) -> Result<()> {
        let Some(writer) = self.writer.filter(|_| self.target.is_dir()) else { return Ok(()) };
        for name in FileList::read(&self.target, writer)?.others(&self.target)? {
            let (old, new) = (self.target.join(&name), self.from.join(&name));
            if fs::symlink_metadata(&new).is_ok() {
                return Err(not_ours(&old, writer));
            }
            let link = || -> io::Result<()> {
                fs::create_dir_all(parent_of(&new))?;
                if old.is_dir() && !old.is_symlink() {
                    return fs::create_dir_all(&new);
                }
                match fs::hard_link(&old, &new) {
                    Err(_) if old.is_file() => fs::copy(&old, &new).map(drop),
                    done => done,
                }
            };
            link().map_err(|e| FormatError::io(&old, "keep", e))?;
        }
        Ok(())
    }
}

/// The error for a file that somebody else has put into a folder of results, and that would be replaced.
pub(super) fn not_ours(path: &Path, writer: &str) -> FormatError {
    let found = format!("a file that {writer} has not written (move it away, or choose another folder)");
    FormatError::not_a(path, format!("a free name, or a file of an earlier {writer}"), found)
}

/// Refuse an output that exists and may not be replaced.
pub(super) fn refuse_existing(target: &Path, overwrite: bool) -> Result<()> {
    if !overwrite && fs::symlink_metadata(target).is_ok() {
        return Err(FormatError::Exists { path: target.into() });
    }
    Ok(())
}

/// Flush the rename to the disk. A file system that cannot do this is not an error.
pub(super) fn sync_folder(target: &Path) {
    if let Ok(dir) = File::open(parent_of(target)) {
        let _ = dir.sync_all();
    }
}

/// Rename, and never replace a file that has appeared in the meantime.
fn rename_to_a_new_name(from: &Path, target: &Path) -> io::Result<()> {
    match renameat_with(CWD, from, CWD, target, RenameFlags::NOREPLACE).map_err(io::Error::from) {
        Err(e) if e.kind() == io::ErrorKind::AlreadyExists => Err(e),
        // File systems without this kind of rename.
        Err(_) if fs::symlink_metadata(target).is_err() => fs::rename(from, target),
        done => done,
    }
}

/// A file that replaces another one gets its permissions. A private one is for its owner alone.
fn restrict(from: &Path, target: &Path, private: bool) -> io::Result<()> {
    let is_folder = from.is_dir();
    let own = fs::metadata(from)?.permissions().mode();
    let old = fs::metadata(target).ok().filter(|meta| meta.is_dir() == is_folder);
    let mut mode = old.map_or(own, |meta| meta.permissions().mode()) & 0o777;
    if private {
        mode &= 0o700;
    }
    if mode == own & 0o777 { Ok(()) } else { fs::set_permissions(from, Permissions::from_mode(mode)) }
}
