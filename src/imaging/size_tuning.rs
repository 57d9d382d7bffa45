//! Rules for a size and a cell of an image that are chosen from the coverage.

use serde::{Deserialize, Serialize};

/// Rules for a size and a cell that are chosen from the coverage.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SizeTuning {
    /// Cells per fringe of the longest baseline, 1 / (longest baseline in wavelengths). The main lobe with natural weights is about one fringe
    /// wide, so 4 cells sample it well enough for a fit and for components between pixels. Below 2 the longest baseline aliases.
    pub cells_per_fringe: f64,
    /// Smallest side that is chosen, pixels: a smaller image saves no time.
    pub least_side: usize,
    /// Largest side that is chosen, pixels: a larger image needs minutes, and the caller should ask for it.
    pub largest_side: usize,
    /// Width of the field in units of wavelength / diameter of the smallest antenna. The first nulls of a uniform circular aperture are
    /// 2.44 apart.
    pub field_per_lobe: f64,
    /// Power of an element pattern, relative to its axis, at which its main lobe ends.
    pub edge_of_lobe: f64,
    /// Without antenna diameters: width of the field in fringes of the shortest baseline. Structure that is wider than a fringe is not measured.
    pub field_per_fringe: f64,
    /// With antenna diameters: largest width of the field, as a multiple of the width that follows from the shortest baseline.
    pub most_fields: f64,
    /// Largest width of the field, as a difference of direction cosines: the square of this width lies inside the horizon.
    pub widest_field: f64,
}

impl Default for SizeTuning {
    fn default() -> Self {
        Self {
            cells_per_fringe: 4.0,
            least_side: 64,
            largest_side: 4096,
            field_per_lobe: 2.4,
            edge_of_lobe: 0.01,
            field_per_fringe: 2.0,
            most_fields: 4.0,
            widest_field: 1.4,
        }
    }
}
