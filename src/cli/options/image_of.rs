//! One image of one set of visibilities in one file: what `beam`, `dirty` and `grid` have in common.

use super::{ColumnArgs, OutputArgs};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::imaging::{Imager, ImagingOptions};
use cittert_arrays::Image;
use cittert_formats::fits::{ImageOptions, write_image};
use clap::Args;
use std::path::{Path, PathBuf};

/// Visibilities, what to make of them, and where it goes.
#[derive(Debug, Clone, Args)]
pub struct ImageOfArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingOptions,
    /// Where the result goes.
    #[command(flatten)]
    pub out: OutputArgs,
}

impl ImageOfArgs {
    /// Refuse an output that is in the way, open the set, and hand its imager to `work`; errors say what was done to which file.
    ///
    /// # Errors
    /// Anything wrong with the file or the options, and those of `work`.
    pub fn imaged<R>(&self, doing: &str, context: &Context, work: impl FnOnce(&mut Imager<'_>) -> crate::Result<R>) -> Result<R> {
        self.out.check(&self.out.output)?;
        let mut source = self.column.open(&self.input)?;
        let what = format!("{doing} {}", self.input.display());
        let mut imager = Imager::new(source.as_mut(), self.imaging.clone(), &context.console).context(&what)?;
        work(&mut imager).context(&what)
    }

    /// Write the image as FITS with the command line in its history; the path it has then.
    ///
    /// # Errors
    /// What the disk says.
    pub fn write(&self, image: &mut Image, context: &Context) -> Result<&Path> {
        image.history.push(context.history());
        write_image(&self.out.output, image, ImageOptions { overwrite: self.out.overwrite, ..ImageOptions::default() })?;
        Ok(&self.out.output)
    }
}
