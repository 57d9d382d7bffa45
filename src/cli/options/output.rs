//! `-o` and `--overwrite`.

use super::claim::{is_one_file, keep_apart};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::cli::ranks::is_silent;
use cittert_arrays::{Image, VisibilityHeader, VisibilitySink};
use cittert_formats::atomic;
use cittert_formats::fits::{ImageOptions, write_image};
use clap::Args;
use std::path::{Path, PathBuf};

/// For a command that reads no files.
pub const NOTHING: [&Path; 0] = [];

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

    /// Check early, before any work, whether outputs can be written and collide with nothing. Every command that writes calls this with all files
    /// that it writes and all that it reads. An output that is changed in place is left out of the inputs, see [`OutputArgs::edit`].
    ///
    /// # Errors
    /// An output that is an input or another output; that exists without `--overwrite`; that is a pipe or device; that cannot be written.
    pub fn claim(
        &self,
        outputs: impl IntoIterator<Item = impl AsRef<Path>>,
        inputs: impl IntoIterator<Item = impl AsRef<Path>>,
    ) -> Result<()> {
        let (outputs, inputs): (Vec<_>, Vec<_>) = (outputs.into_iter().collect(), inputs.into_iter().collect());
        let outputs: Vec<&Path> = outputs.iter().map(AsRef::as_ref).collect();
        let inputs: Vec<&Path> = inputs.iter().map(AsRef::as_ref).collect();
        keep_apart(&outputs, &inputs)?;
        if is_silent() {
            return Ok(());
        }
        outputs.into_iter().try_for_each(|path| self.check(path))
    }

    /// Lock the output until the command has ended, if it is the input and therefore changed in place. To be called before the input is opened.
    ///
    /// # Errors
    /// Another process changes the file.
    pub fn edit(&self, input: &Path) -> Result<()> {
        if input.exists() && is_one_file(&self.output, input) {
            atomic::hold(input)?;
        }
        Ok(())
    }

    fn check(&self, path: &Path) -> Result<()> {
        if path.symlink_metadata().is_ok() && !self.overwrite {
            return Err(Failure::message(format!("{}: it exists already; use --overwrite to replace it, or another -o", path.display())));
        }
        cittert_formats::refuse_special(path)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        if !folder.is_dir() {
            return Err(Failure::message(format!("{}: the folder {} does not exist; make it first", path.display(), folder.display())));
        }
        atomic::try_output(path)?;
        if path.exists() {
            // Another process that changes the file would lose its changes, or those of this command.
            atomic::hold(path)?;
        }
        Ok(())
    }

    /// PREFIX with each suffix.
    pub fn all_suffixed(&self, suffixes: &[&str]) -> Vec<PathBuf> {
        suffixes.iter().map(|s| self.suffixed(s)).collect()
    }

    /// Write bytes to a file that appears under its name only when it is complete.
    ///
    /// # Errors
    /// An error of the file system, with the path.
    pub fn write(&self, path: &Path, bytes: &[u8]) -> Result<()> {
        if is_silent() {
            return Ok(());
        }
        Ok(atomic::write_file(path, self.overwrite, bytes)?)
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
    pub fn image<P: Copy + Into<f64> + Sync>(&self, path: &Path, image: &mut Image<P>, context: &Context) -> Result<()> {
        image.history.push(context.history());
        self.signed_image(path, image)
    }

    /// Write an image whose history has this command already.
    ///
    /// # Errors
    /// An error of the file system, with the path.
    pub fn signed_image<P: Copy + Into<f64> + Sync>(&self, path: &Path, image: &Image<P>) -> Result<()> {
        if is_silent() {
            return Ok(());
        }
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
