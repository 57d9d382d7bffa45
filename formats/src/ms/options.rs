//! What a Measurement Set is, which of its columns are read, and how it is written.

use crate::VisColumn;
use std::path::Path;

/// Options of a new Measurement Set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MsOptions {
    /// Replace an existing Measurement Set.
    pub overwrite: bool,
    /// Write MODEL_DATA. Every block must then bring it.
    pub model: bool,
    /// Write CORRECTED_DATA. Every block must then bring it.
    pub corrected: bool,
    /// Write a set of Stokes I as XX and YY instead of RR and LL.
    pub linear_hands: bool,
}

/// A column of visibilities of a Measurement Set.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MsColumn {
    /// The observed visibilities.
    #[default]
    Data,
    /// The data after calibration.
    Corrected,
    /// The visibilities of the model.
    Model,
}

impl MsColumn {
    /// The column of the same meaning, where there is one.
    #[must_use]
    pub fn of(column: VisColumn) -> Option<Self> {
        match column {
            VisColumn::Data => Some(Self::Data),
            VisColumn::Corrected => Some(Self::Corrected),
            VisColumn::Model => Some(Self::Model),
            VisColumn::Residual => None,
        }
    }

    /// Name in the main table.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Data => "DATA",
            Self::Corrected => "CORRECTED_DATA",
            Self::Model => "MODEL_DATA",
        }
    }
}

/// True for a directory that holds a casacore table with subtables of a Measurement Set, complete or not.
#[must_use]
pub fn is_measurement_set(path: &Path) -> bool {
    path.join("table.dat").is_file() && ["ANTENNA", "SPECTRAL_WINDOW", "DATA_DESCRIPTION"].iter().any(|name| path.join(name).is_dir())
}
