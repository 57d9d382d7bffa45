//! Which visibilities of a Measurement Set are read.

use crate::cli::failure::Result;
use cittert_arrays::VisibilitySource;
use clap::Args;
use std::path::Path;

/// The column of a set to read.
#[derive(Debug, Clone, Args)]
pub struct ColumnArgs {
    /// Visibilities of a Measurement Set to read: data, corrected or model.
    #[arg(long, value_name = "COLUMN", default_value = "data", value_parser = ["data", "corrected", "model"])]
    column: String,
}

impl ColumnArgs {
    /// Open the visibilities of any format.
    ///
    /// # Errors
    /// A broken file, or a column that it does not have.
    pub fn open(&self, path: &Path) -> Result<Box<dyn VisibilitySource>> {
        Ok(cittert_formats::open_column(path, &self.column)?)
    }
}
