//! Files that get their final name only when they are complete.

use super::copy::copy_bytes;
use super::partial::{Partial, clear, explain};
use super::publish::{Finished, Flush, refuse_existing};
use super::together::{finish, publish_now};
use crate::{FormatError, Result};
use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A file being written beside its final name. Dropping it without [`AtomicFile::commit`] removes what was written.
#[derive(Debug)]
pub struct AtomicFile {
    target: PathBuf,
    from: PathBuf,
    partial: Partial,
    overwrite: bool,
}

impl AtomicFile {
    /// Begin an output with the final name `path`.
    ///
    /// # Errors
    /// The output exists and `overwrite` is false, it is a directory or another special file, or its directory is missing or not writable.
    pub fn create(path: &Path, overwrite: bool) -> Result<Self> {
        let target = resolve(path);
        clear(&target);
        refuse_existing(&target, overwrite)?;
        if let Ok(meta) = fs::metadata(&target)
            && !meta.is_file()
        {
            let found = if meta.is_dir() { "it is a directory" } else { "it is a device or pipe" };
            return Err(FormatError::not_a(&target, "the name of a file to write", found));
        }
        let partial = Partial::beside(&target)?;
        // The file has its own name already, so that a name that is too long for the file system is found now.
        let from = partial.place(target.file_name().unwrap_or_default());
        OpenOptions::new().write(true).create_new(true).open(&from).map_err(|e| FormatError::io(&target, "create", explain(&target, e)))?;
        Ok(Self { target, from, partial, overwrite })
    }

    /// The file to write to: an empty file in a hidden folder in the directory of the output.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.from
    }

    /// The final name.
    #[must_use]
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The hidden file, opened to write.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn open(&self) -> Result<File> {
        OpenOptions::new().read(true).write(true).open(&self.from).map_err(|e| FormatError::io(&self.target, "write", e))
    }

    /// Begin with the bytes of another file, to change some of them.
    ///
    /// # Errors
    /// An error of the file system; a full disk.
    pub fn fill_from(&self, from: &Path) -> Result<()> {
        let mut old = File::open(from).map_err(|e| FormatError::io(from, "open", e))?;
        copy_bytes(&mut old, &mut self.open()?).map_err(|e| FormatError::io(&self.target, "copy the old file to", e))
    }

    /// Flush the bytes to the disk and give the file its final name, together with the other outputs of the command.
    ///
    /// # Errors
    /// An error of the file system; a full disk often shows here, or when the outputs get their names. The old output then stays in place.
    pub fn commit(self) -> Result<()> {
        finish(self.finished()?)
    }

    /// [`AtomicFile::commit`] without waiting for the other outputs of the command.
    ///
    /// # Errors
    /// As [`AtomicFile::commit`].
    pub fn commit_now(self) -> Result<()> {
        publish_now(self.finished()?)
    }

    fn finished(self) -> Result<Finished> {
        let flush = Flush::begin(self.open()?).map_err(|e| FormatError::io(&self.target, "flush to disk", e))?;
        let Self { target, from, partial, overwrite } = self;
        Ok(Finished { partial: Arc::new(partial), from, target, overwrite, writer: None, flush: Some(flush) })
    }
}

/// A hidden folder for files of which only some become outputs. It is removed with all others.
#[derive(Debug)]
pub struct Drafts {
    partial: Arc<Partial>,
}

impl Drafts {
    /// A hidden folder beside the output `path`.
    ///
    /// # Errors
    /// The directory of the output is missing or not writable.
    pub fn beside(path: &Path) -> Result<Self> {
        Ok(Self { partial: Arc::new(Partial::beside(path)?) })
    }

    /// The path of the draft with this name.
    #[must_use]
    pub fn path(&self, name: &str) -> PathBuf {
        self.partial.place(name)
    }

    /// Make the draft with this name the output `target`, together with the other outputs of the command.
    ///
    /// # Errors
    /// The output exists and `overwrite` is false, or an error of the file system.
    pub fn publish(&self, name: &str, target: &Path, overwrite: bool) -> Result<()> {
        let (partial, from, target) = (self.partial.clone(), self.path(name), resolve(target));
        finish(Finished { partial, from, target, overwrite, writer: None, flush: None })
    }
}

/// Write the whole content of a small output at once.
///
/// # Errors
/// As [`AtomicFile::create`] and [`AtomicFile::commit`].
pub fn write_file(path: &Path, overwrite: bool, content: &[u8]) -> Result<()> {
    filled(path, overwrite, content)?.commit()
}

/// [`write_file`] without waiting for the other outputs of the command.
///
/// # Errors
/// As [`write_file`].
pub fn write_file_now(path: &Path, overwrite: bool, content: &[u8]) -> Result<()> {
    filled(path, overwrite, content)?.commit_now()
}

fn filled(path: &Path, overwrite: bool, content: &[u8]) -> Result<AtomicFile> {
    let out = AtomicFile::create(path, overwrite)?;
    io::Write::write_all(&mut out.open()?, content).map_err(|e| FormatError::io(path, "write", e))?;
    Ok(out)
}

/// Try whether an output with this name can be written, and leave nothing behind.
///
/// # Errors
/// A directory that is missing or not writable, a name that is too long, or a full disk.
pub fn try_output(path: &Path) -> Result<()> {
    let target = resolve(path);
    clear(&target);
    let partial = Partial::beside(&target)?;
    let from = partial.place(target.file_name().unwrap_or_default());
    // Some file systems find out that the disk is full only when bytes are written.
    fs::write(from, [0; 512]).map_err(|e| FormatError::io(&target, "create", explain(&target, e)))
}

/// Follow symbolic links, so that a link to an output stays a link.
pub(super) fn resolve(path: &Path) -> PathBuf {
    match fs::symlink_metadata(path) {
        Ok(meta) if meta.is_symlink() => fs::canonicalize(path).unwrap_or_else(|_| path.into()),
        _ => path.into(),
    }
}
