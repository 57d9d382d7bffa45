//! Folders that get their final name only when they are complete.

use super::copy::copy_folder;
use super::file::resolve;
use super::list::{FileList, LIST};
use super::partial::{Partial, clear, explain};
use super::publish::{Finished, refuse_existing};
use super::together::finish;
use crate::{FormatError, Result};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Which folders an output may replace, so that a mistyped name cannot delete another folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Replaces {
    /// A set of data that is a folder: one that holds a file of this name. It is replaced as a whole.
    Holding(&'static str),
    /// Results of the program of this name. Only the files that it has written are replaced, and the files of others are kept.
    FilesOf(&'static str),
}

/// A directory being written beside its final name (a Measurement Set, the results of a run).
#[derive(Debug)]
pub struct AtomicDir {
    target: PathBuf,
    from: PathBuf,
    partial: Partial,
    overwrite: bool,
    writer: Option<&'static str>,
}

impl AtomicDir {
    /// Begin a directory with the final name `path`.
    ///
    /// # Errors
    /// The output exists and `overwrite` is false, or is not a directory that may be replaced, or its parent directory is not writable.
    pub fn create(path: &Path, overwrite: bool, replaces: Replaces) -> Result<Self> {
        let target = resolve(path);
        clear(&target);
        refuse_existing(&target, overwrite)?;
        if target.exists() {
            let not = |expected: String, found: &str| Err(FormatError::not_a(&target, expected, found));
            match replaces {
                _ if !target.is_dir() => return not("a directory, or a new name for one".into(), "a file"),
                Replaces::Holding(file) if !target.join(file).exists() => {
                    return not(format!("a directory with {file}, which may be replaced"), &format!("a directory without {file}"));
                }
                Replaces::Holding(_) => {}
                Replaces::FilesOf(writer) => drop(FileList::read(&target, writer)?),
            }
        }
        let partial = Partial::beside(&target)?;
        let from = partial.place(target.file_name().unwrap_or_default());
        fs::create_dir(&from).map_err(|e| FormatError::io(&target, "create", explain(&target, e)))?;
        let writer = if let Replaces::FilesOf(writer) = replaces { Some(writer) } else { None };
        Ok(Self { target, from, partial, overwrite, writer })
    }

    /// The directory to write to: an empty directory in a hidden one beside the output.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.from
    }

    /// Begin with the content of another directory, to change some of it.
    ///
    /// # Errors
    /// An error of the file system; a full disk.
    pub fn fill_from(&self, from: &Path) -> Result<()> {
        copy_folder(from, &self.from).map_err(|e| FormatError::io(&self.target, "copy the old directory to", e))
    }

    /// Flush every file to the disk and give the directory its final name, together with the other outputs of the command.
    ///
    /// # Errors
    /// An error of the file system. The old output then stays in place.
    pub fn commit(self) -> Result<()> {
        let Self { target, from, partial, overwrite, writer } = self;
        if let Some(writer) = writer {
            let list = FileList::of_all_in(&from)?.text(writer);
            fs::write(from.join(LIST), list).map_err(|e| FormatError::io(&target, "write the list of the files in", e))?;
        }
        sync_tree(&from).map_err(|e| FormatError::io(&target, "flush to disk", e))?;
        finish(Finished { partial: Arc::new(partial), from, target, overwrite, writer, flush: None })
    }
}

fn sync_tree(dir: &Path) -> io::Result<()> {
    for entry in fs::read_dir(dir)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            sync_tree(&entry.path())?;
        } else {
            File::open(entry.path())?.sync_all()?;
        }
    }
    Ok(())
}
