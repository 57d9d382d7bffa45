//! The columns of visibilities of a file, and how an output of visibilities is begun.
//!
//! Beside the data a file may hold the visibilities of a model, the corrected data, and the residual (data minus model).

use crate::{Compression, FormatError, Result};
use cittert_arrays::{VisibilityBlock, VisibilitySink};
use ndarray::ArrayView3;
use num_complex::Complex;
use std::path::Path;

/// A column of visibilities.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum VisColumn {
    /// The observed visibilities.
    #[default]
    Data,
    /// The visibilities of the model.
    Model,
    /// The data after calibration.
    Corrected,
    /// The data minus the model.
    Residual,
}

impl VisColumn {
    /// All columns, the data first.
    pub const ALL: [Self; 4] = [Self::Data, Self::Model, Self::Corrected, Self::Residual];

    /// Name of the column, as users write it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Model => "model",
            Self::Corrected => "corrected",
            Self::Residual => "residual",
        }
    }

    /// The column with this name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }
}

/// Options of a new output of visibilities.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CreateOptions {
    /// Replace an existing output.
    pub overwrite: bool,
    /// Keep the rows of an existing output with the same header, and append to them.
    pub append: bool,
    /// Compression of the visibilities; `None` takes the default of the format.
    pub compression: Option<Compression>,
    /// Columns beside the data. Every block must then bring them.
    pub columns: Vec<VisColumn>,
}

/// What changes in a copy of a file of visibilities. All else stays as it is, byte for byte.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Edit {
    /// Replace an existing output. The output may be the input itself.
    pub overwrite: bool,
    /// The data change, with their weights and flags. Flags are only added.
    pub data: bool,
    /// Columns beside the data that are added or replaced. Every block must then bring them.
    pub columns: Vec<VisColumn>,
    /// Lines that are added to the history.
    pub history: Vec<String>,
}

/// A new output of visibilities.
pub struct Created {
    /// Takes the blocks.
    pub sink: Box<dyn ColumnSink>,
    /// Changes and losses in the header, one sentence each, for the user and for the history.
    pub notes: Vec<String>,
}

/// An output that takes columns beside the data.
pub trait ColumnSink: VisibilitySink {
    /// Append a block, with the visibilities \[blt, chan, pol\] of each column in the order of [`CreateOptions::columns`].
    ///
    /// # Errors
    /// A block or column whose shape is not that of the header, or an error of the file system.
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()>;
}

/// Check that an edit got every row of the file.
pub(crate) fn check_rows(path: &Path, edited: usize, rows: usize) -> Result<()> {
    if edited == rows {
        return Ok(());
    }
    Err(FormatError::malformed(path, "rows", format!("all {rows} rows of the file"), format!("{edited} rows")))
}

/// Check that `n` columns beside the data are given, each with the shape of the data.
pub(crate) fn check_columns(path: &Path, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>], n: usize) -> Result<()> {
    let found: Vec<_> = columns.iter().map(ArrayView3::shape).collect();
    let expected = vec![block.vis.shape(); n];
    if found == expected {
        return Ok(());
    }
    Err(FormatError::malformed(path, "columns beside the data", format!("shapes {expected:?}"), format!("{found:?}")))
}
