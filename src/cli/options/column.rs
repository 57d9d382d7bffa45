//! Which visibilities of a file are read.

use cittert_formats::VisColumn;
use clap::Args;

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
}
