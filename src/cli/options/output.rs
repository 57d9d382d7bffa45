//! `-o` and `--overwrite`.

use crate::cli::failure::{Failure, Result};
use clap::Args;
use std::path::{Path, PathBuf};

/// Where the result goes.
#[derive(Debug, Clone, Args)]
pub struct OutputArgs {
    /// Output file (or prefix, where several files are made).
    #[arg(short, long, value_name = "PATH")]
    pub output: PathBuf,
    /// Replace an output that exists.
    #[arg(long)]
    pub overwrite: bool,
}

impl OutputArgs {
    /// The path PREFIX + suffix.
    #[must_use]
    pub fn suffixed(&self, suffix: &str) -> PathBuf {
        let mut name = self.output.clone().into_os_string();
        name.push(suffix);
        PathBuf::from(name)
    }

    /// Check early, before the work, whether the output can be written.
    ///
    /// # Errors
    /// An output that exists without `--overwrite` or is a pipe or device, or a folder that does not exist.
    pub fn check(&self, path: &Path) -> Result<()> {
        if path.symlink_metadata().is_ok() && !self.overwrite {
            return Err(Failure::message(format!("{}: it exists already; use --overwrite to replace it, or another -o", path.display())));
        }
        cittert_formats::refuse_special(path)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(Failure::message(format!("{}: the folder {} does not exist; make it first", path.display(), folder.display())));
        }
        Ok(())
    }

    /// [`OutputArgs::check`] for PREFIX with each suffix.
    ///
    /// # Errors
    /// As [`OutputArgs::check`].
    pub fn check_all(&self, suffixes: &[&str]) -> Result<()> {
        suffixes.iter().try_for_each(|s| self.check(&self.suffixed(s)))
    }

    /// Write bytes to a file that appears under its name only when it is complete.
    ///
    /// # Errors
    /// An error of the file system, with the path.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        Ok(cittert_formats::atomic::write_file(path, self.overwrite, bytes)?)
    }
}
