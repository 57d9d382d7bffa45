//! The journal of a search: the problem on its first line, then one line for each finished attempt.

use crate::ChainError;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::design::{Found, journal};
use cittert_formats::FormatError;
use cittert_formats::atomic::write_file_now;
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::Write;
use std::path::{Path, PathBuf};

/// The journal, open at its end and locked.
pub(super) struct Journal {
    file: File,
    path: PathBuf,
}

impl Journal {
    /// Open the journal of a search, or make one. Returns it with the finished attempts.
    ///
    /// # Errors
    /// A file that is not the journal of this search, unless `overwrite` is set; another process that writes it; an error of the file system.
    pub(super) fn open(
        path: &Path,
        fingerprint: &str,
        elements: usize,
        overwrite: bool,
        context: &Context,
    ) -> Result<(Self, BTreeMap<u64, Found>)> {
        cittert_formats::refuse_special(path)?;
        let mut done = BTreeMap::new();
        // A process that makes this search has locked the file, which must not be replaced then.
        let old = if path.exists() { Some(locked(path)?) } else { None };
        if old.is_some() {
            let text = cittert_formats::read_text(path)?;
            let (first, rest) = text.split_once('\n').unwrap_or((&text, ""));
            if first == fingerprint {
                let damaged;
                (done, damaged) = journal::attempts(rest, elements);
                if damaged > 0 {
                    context.console.warn(&format!("{}: {damaged} damaged lines; their attempts are made again", path.display()));
                }
            } else {
                let text = format!(
                    "{}: it is not the journal of this search; use the options with which it began, or --overwrite to begin anew",
                    path.display()
                );
                ensure!(overwrite && first.starts_with("cittert "), Failure::message(text));
            }
        }
        let lines: String = done.values().map(journal::line).collect();
        write_file_now(path, true, format!("{fingerprint}\n{lines}").as_bytes())?;
        Ok((Self { file: locked(path)?, path: path.into() }, done))
    }

    /// Add an attempt. It is on the disk when this function returns.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn append(&mut self, found: &Found) -> crate::Result<()> {
        let written = self.file.write_all(journal::line(found).as_bytes()).and_then(|()| self.file.sync_data());
        written.map_err(|e| ChainError::Other(Box::new(FormatError::io(&self.path, "write", e))))
    }

    /// Remove the file: the search has ended.
    ///
    /// # Errors
    /// An error of the file system.
    pub(super) fn remove(self) -> Result<()> {
        std::fs::remove_file(&self.path).context(format!("{}: cannot remove the journal", self.path.display()))
    }
}

/// A journal open at its end, with its lock.
fn locked(path: &Path) -> Result<File> {
    let file = OpenOptions::new().append(true).open(path).context(format!("{}", path.display()))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => {
            Err(Failure::message(format!("{}: another process makes this search; wait for it, or choose another -o", path.display())))
        }
        Err(TryLockError::Error(e)) => Err(e).context(format!("{}: cannot lock it", path.display())),
    }
}
