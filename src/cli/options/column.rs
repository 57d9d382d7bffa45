//! Which visibilities of a file are read.

use crate::cli::failure::Result;
use cittert_arrays::VisibilitySource;
use cittert_formats::VisColumn;
use clap::Args;
use std::path::Path;

/// The column of a set to read.
#[derive(Debug, Clone, Args)]
pub struct ColumnArgs {
    /// Visibilities of a UVH5 file or Measurement Set to read: data, model, corrected or residual.
    #[arg(long, value_name = "COLUMN", value_parser = ["data", "model", "corrected", "residual"])]
    column: Option<String>,
}

impl ColumnArgs {
    /// The column, if one was named.
    #[must_use]
    pub fn chosen(&self) -> Option<VisColumn> {
        self.column.as_deref().and_then(VisColumn::named)
    }

    /// Open the visibilities of any format.
    ///
    /// # Errors
    /// A broken file, or a column that it does not have.
    pub fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(cittert_formats::open_column(path, self.chosen().unwrap_or_default())?)
    }
}
