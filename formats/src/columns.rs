//! Visibilities that stand beside the data in one file: of a model, corrected, and what is left without the model.

use crate::{Compression, Result};
use cittert_arrays::{VisibilityBlock, VisibilitySink};
use ndarray::ArrayView3;
use num_complex::Complex;

/// Which visibilities of a file are meant.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub enum VisColumn {
    /// As observed.
    #[default]
    Data,
    /// Of the model.
    Model,
    /// After calibration.
    Corrected,
    /// Without the model.
    Residual,
}

impl VisColumn {
    /// All columns, the data first.
    pub const ALL: [Self; 4] = [Self::Data, Self::Model, Self::Corrected, Self::Residual];

    /// What a user calls it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "data",
            Self::Model => "model",
            Self::Corrected => "corrected",
            Self::Residual => "residual",
        }
    }

    /// The column of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|c| c.name() == name)
    }
}

/// How an output of visibilities is begun.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CreateOptions {
    /// Replace an existing output.
    pub overwrite: bool,
    /// Keep the rows of an existing output of the same header, and write behind them.
    pub append: bool,
    /// Compression of the visibilities; `None` leaves it to the format.
    pub compression: Option<Compression>,
    /// Columns beside the data, which every block then brings.
    pub columns: Vec<VisColumn>,
}

/// An output that takes columns beside the data.
pub trait ColumnSink: VisibilitySink {
    /// Append a block with the visibilities \[blt, chan, pol\] of each column that the output was begun with, in that order.
    ///
    /// # Errors
    /// A block or column of another shape than the header's, or whatever the disk says.
    fn write_columns(&mut self, block: &VisibilityBlock, columns: &[ArrayView3<'_, Complex<f32>>]) -> Result<()>;
}
