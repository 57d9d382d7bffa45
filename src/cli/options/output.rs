//! `-o` and `--overwrite`.

use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use cittert_arrays::{Image, VisibilityHeader, VisibilitySink};
use cittert_formats::fits::{ImageOptions, write_image};
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

    /// Create the output for visibilities, and print what its format cannot hold.
    ///
    /// # Errors
    /// A format that cannot hold the set, or an error of the file system.
    pub fn visibilities(&self, header: &VisibilityHeader, context: &Context) -> Result<Box<dyn VisibilitySink>> {
        let created = cittert_formats::create_visibilities(&self.output, header, self.overwrite)?;
        created.notes.iter().for_each(|n| context.console.note(n));
        Ok(created.sink)
    }

    /// Write an image as FITS, with the command line at the end of its history.
    ///
    /// # Errors
    /// An error of the file system, with the path.
    pub fn image(&self, path: &Path, image: &mut Image, context: &Context) -> Result<()> {
        image.history.push(context.history());
        Ok(write_image(path, image, ImageOptions { overwrite: self.overwrite, ..ImageOptions::default() })?)
    }

    /// Write images as PREFIX with each suffix, and add them to the outcome.
    ///
    /// # Errors
    /// An error of the file system, with the path.
    pub fn images(
        &self,
        named: impl IntoIterator<Item = (&'static str, Image)>,
        context: &Context,
        mut outcome: Outcome,
    ) -> Result<Outcome> {
        for (suffix, mut image) in named {
            let path = self.suffixed(suffix);
            self.image(&path, &mut image, context)?;
            outcome = outcome.wrote(path);
        }
        Ok(outcome)
    }
}
