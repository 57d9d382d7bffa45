//! The arguments and steps that `beam`, `dirty` and `grid` share: one set of visibilities, one image, one output.

use super::{ColumnArgs, OutputArgs, range_file, with_range};
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};
use crate::imaging::{Imager, ImagingOptions};
use cittert_arrays::Image;
use clap::Args;
use std::path::{Path, PathBuf};

/// The visibilities, the options of their image, and the output.
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
    /// Check the output, open the set, and pass its imager to `work`. Errors name the work and the file.
    ///
    /// # Errors
    /// The file or an option is wrong, and the errors of `work`.
    pub fn imaged<R>(&self, doing: &str, context: &Context, work: impl FnOnce(&mut Imager<'_>) -> crate::Result<R>) -> Result<R> {
        let map = self.imaging.range.as_ref().and_then(range_file);
        self.out.claim([&self.out.output], [self.input.as_path()].into_iter().chain(map))?;
        let imaging = with_range(&self.imaging)?;
        let mut source = self.column.open(&self.input)?;
        let what = format!("{doing} {}", self.input.display());
        let mut imager = Imager::new(source.as_mut(), imaging, &context.console).context(&what)?;
        work(&mut imager).context(&what)
    }

    /// Refuse a range, where the result is no image.
    ///
    /// # Errors
    /// A range.
    pub fn no_range(&self, instead: &str) -> Result<()> {
        super::no_range(&self.imaging, instead)
    }

    /// Write the image as FITS with the command line in its history, and return its path.
    ///
    /// # Errors
    /// An error of the file system.
    pub fn write<P: Copy + Into<f64>>(&self, image: &mut Image<P>, context: &Context) -> Result<&Path> {
        self.out.image(&self.out.output, image, context)?;
        Ok(&self.out.output)
    }
}
