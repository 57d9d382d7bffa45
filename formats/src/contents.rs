//! What is in any file that is read here: found by content, then summed up.

use crate::calh5::{is_gains, read_gains};
use crate::info::{GainInfo, ImageInfo, VisibilityInfo};
use crate::layouts::{LayoutError, read_layout};
use crate::registry::{describe, image_names, start_of, visibility_names};
use crate::{FormatError, IMAGE_FORMATS, Result, VISIBILITY_FORMATS, read_sources, visibility_format};
use cittert_arrays::{ArrayLayout, SourceShape};
use serde::Serialize;
use std::path::Path;

/// What is in a layout.
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

/// What is in a source list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SourceListInfo {
    /// Number of sources.
    pub n_sources: usize,
    /// Number of those that are extended.
    pub n_gaussians: usize,
    /// Sum of the flux densities, Jy.
    pub total_flux_jy: f64,
}

/// What is in a file, by its kind.
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
    /// Find out what a file is and sum it up in one pass.
    ///
    /// # Errors
    /// A file of no known kind, or whatever is wrong inside it.
    pub fn of(path: &Path) -> Result<Self> {
        if path.is_dir() {
            // An OSKAR telescope model is a layout; a Measurement Set is read, or refused with advice by a build that cannot.
            if path.join("layout.txt").is_file() {
                return Ok(Self::Layout(LayoutInfo::of(&read_layout(path, None)?)));
            }
            let format = visibility_format(path)?;
            let mut source = format.open(path)?;
            let info = VisibilityInfo::of(source.as_mut()).map_err(|e| FormatError::values(path, e))?;
            return Ok(Self::Visibilities { format: format.name(), info: Box::new(info) });
        }
        let start = start_of(path)?;
        if let Some(format) = VISIBILITY_FORMATS.iter().find(|f| f.sniff(path, &start)) {
            let mut source = format.open(path)?;
            let info = VisibilityInfo::of(source.as_mut()).map_err(|e| FormatError::values(path, e))?;
            return Ok(Self::Visibilities { format: format.name(), info: Box::new(info) });
        }
        if let Some(format) = IMAGE_FORMATS.iter().find(|f| f.sniff(path, &start)) {
            return Ok(Self::Image { format: format.name(), info: Box::new(ImageInfo::of(&format.read(path)?)) });
        }
        if is_gains(path) {
            return Ok(Self::Gains { format: "CalH5", info: Box::new(GainInfo::of(&read_gains(path)?)) });
        }
        let text = String::from_utf8_lossy(&start);
        let names = text.lines().find(|l| !l.trim_start().starts_with('#') && !l.trim().is_empty()).unwrap_or("");
        if names.split(',').any(|n| n.trim() == "flux_jy") {
            let sources = read_sources(path)?;
            return Ok(Self::Sources(SourceListInfo {
                n_sources: sources.len(),
                n_gaussians: sources.iter().filter(|s| s.shape != SourceShape::Point).count(),
                total_flux_jy: sources.iter().map(|s| s.flux_jy).sum(),
            }));
        }
        match read_layout(path, None) {
            Ok(layout) => Ok(Self::Layout(LayoutInfo::of(&layout))),
            Err(LayoutError::File { source, .. })
                if matches!(*source, LayoutError::Unknown | LayoutError::NotText | LayoutError::Empty) =>
            {
                Err(FormatError::NotA {
                    path: path.into(),
                    expected: format!(
                        "visibilities ({}), an image ({}), gains (CalH5), a layout or a source list",
                        visibility_names(),
                        image_names()
                    ),
                    found: format!("it is {}", describe(&start)),
                })
            }
            Err(e) => Err(e.into()),
        }
    }
}
