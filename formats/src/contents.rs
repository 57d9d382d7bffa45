//! A summary of any file. The format is recognised by the content.

use crate::format::Holds;
use crate::info::{GainInfo, ImageInfo, VisibilityInfo};
use crate::layouts::read_layout;
use crate::registry::format_of;
use crate::{FormatError, Result};
use cittert_arrays::{ArrayLayout, Source, SourceShape};
use serde::Serialize;
use std::path::Path;

/// Summary of a layout.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LayoutInfo {
    /// Name of the array.
    pub name: String,
    /// `boresight` or `earth`.
    pub frame: &'static str,
    /// Latitude (rad), longitude (rad) and altitude (m) of the site.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub site: Option<[f64; 3]>,
    /// Number of antennas.
    pub n_antennas: usize,
    /// Names of the antennas.
    pub antenna_names: Vec<String>,
    /// Number of baselines.
    pub n_baselines: usize,
    /// Shortest baseline, m.
    pub shortest_m: f64,
    /// Longest baseline, m.
    pub longest_m: f64,
}

impl LayoutInfo {
    /// Sum up a layout.
    #[must_use]
    pub fn of(layout: &ArrayLayout) -> Self {
        let extent = layout.extent();
        Self {
            name: layout.name.clone(),
            frame: if layout.site().is_some() { "earth" } else { "boresight" },
            site: layout.site().map(|s| [s.latitude_rad, s.longitude_rad, s.altitude_m]),
            n_antennas: layout.n_ant(),
            antenna_names: layout.antennas().iter().map(|a| a.name.clone()).collect(),
            n_baselines: extent.n_baselines,
            shortest_m: extent.shortest_m,
            longest_m: extent.longest_m,
        }
    }
}

/// Summary of a source list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceListInfo {
    /// Number of sources.
    pub n_sources: usize,
    /// Number of Gaussian sources among them.
    pub n_gaussians: usize,
    /// Sum of the flux densities, Jy.
    pub total_flux_jy: f64,
}

impl SourceListInfo {
    /// Sum up a source list.
    #[must_use]
    pub fn of(sources: &[Source]) -> Self {
        Self {
            n_sources: sources.len(),
            n_gaussians: sources.iter().filter(|s| s.shape != SourceShape::Point).count(),
            total_flux_jy: sources.iter().map(|s| s.flux_jy).sum(),
        }
    }
}

/// Summary of a file, by its kind.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Contents {
    /// Visibilities.
    Visibilities {
        /// Name of the format.
        format: &'static str,
        /// What is in them.
        #[serde(flatten)]
        info: Box<VisibilityInfo>,
    },
    /// An image.
    Image {
        /// Name of the format.
        format: &'static str,
        /// What is in it.
        #[serde(flatten)]
        info: Box<ImageInfo>,
    },
    /// Gains.
    Gains {
        /// Name of the format.
        format: &'static str,
        /// What is in them.
        #[serde(flatten)]
        info: Box<GainInfo>,
    },
    /// An antenna layout.
    Layout(LayoutInfo),
    /// A source list.
    Sources(SourceListInfo),
}

impl Contents {
    /// Recognise the format of a file and sum it up in one pass.
    ///
    /// # Errors
    /// A file of no known format, or an error in the file.
    pub fn of(path: &Path) -> Result<Self> {
        let found = format_of(path)?;
        let format = found.name();
        Ok(match found.holds() {
            Holds::Visibilities(f) => {
                let info = VisibilityInfo::of(f.open(path)?.as_mut()).map_err(|e| FormatError::values(path, e))?;
                Self::Visibilities { format, info: Box::new(info) }
            }
            Holds::Images(f) => Self::Image { format, info: Box::new(ImageInfo::of(&(f.read)(path)?)) },
            Holds::Gains(f) => Self::Gains { format, info: Box::new(GainInfo::of(&(f.read)(path)?)) },
            Holds::Sources(f) => Self::Sources(SourceListInfo::of(&(f.read)(path)?)),
            Holds::Layouts(_) => Self::Layout(LayoutInfo::of(&read_layout(path, None)?)),
        })
    }
}
