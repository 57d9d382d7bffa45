//! Measurement Sets of version 2, through casacore's tables (cargo feature `ms`, system package casacore-dev).
//!
//! Imagers of Measurement Sets expect antenna 1 before antenna 2, the baseline from antenna 2 to antenna 1, and the visibilities that
//! belong to it: against the convention in memory uvw are negated and visibilities conjugated, both ways.
//!
//! # Reference
//! Kemball & Wieringa 2000, MeasurementSet definition version 2.0 (AIPS++ Note 229).

mod codes;
mod export;
mod ffi;
mod fields;
mod format;
mod index;
mod keywords;
mod metadata;
mod observatories;
mod own;
mod read;
mod rows;
mod schema;
mod subtables;
mod table;
mod write;

pub use format::MeasurementSet;
pub use read::MsSource;
pub use write::MsWriter;

use std::path::Path;

/// How a Measurement Set is written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MsOptions {
    /// Replace an existing Measurement Set.
    pub overwrite: bool,
    /// Write MODEL_DATA; every block then brings it.
    pub model: bool,
    /// Write CORRECTED_DATA; every block then brings it.
    pub corrected: bool,
    /// Write a set of Stokes I as XX and YY instead of RR and LL.
    pub linear_hands: bool,
}

/// Which visibilities of a Measurement Set are read.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MsColumn {
    /// As observed.
    #[default]
    Data,
    /// After calibration.
    Corrected,
    /// Of the model.
    Model,
}

impl MsColumn {
    /// The column of the same meaning, where there is one.
    #[must_use]
    pub fn of(column: crate::VisColumn) -> Option<Self> {
        match column {
            crate::VisColumn::Data => Some(Self::Data),
            crate::VisColumn::Corrected => Some(Self::Corrected),
            crate::VisColumn::Model => Some(Self::Model),
            crate::VisColumn::Residual => None,
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

/// True for a directory that holds a casacore table with subtables of a Measurement Set, whole or not.
#[must_use]
pub fn is_measurement_set(path: &Path) -> bool {
    path.join("table.dat").is_file() && ["ANTENNA", "SPECTRAL_WINDOW", "DATA_DESCRIPTION"].iter().any(|name| path.join(name).is_dir())
}
