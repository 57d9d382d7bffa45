//! Dirty beams, dirty images and restored images of visibilities, in blocks of rows.
//!
//! [`Imager`] reads a source once, chooses the grid if the caller does not, and makes the weights. It then makes the dirty beam, the dirty image
//! and the residual of a model for each output channel. [`clean`] runs a deconvolver in major cycles; see [`major`].

mod ahead;
mod auto_mask;
mod beam_fit;
mod cells;
mod cleaned;
mod components;
mod continued;
mod data;
mod imager;
pub mod major;
mod output;
mod pol;
mod psf;
mod restore;
mod session;
mod size;
pub mod weights;

#[cfg(test)]
mod cycle_tests;
#[cfg(test)]
mod memory_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod tuning_tests;

pub use beam_fit::fit_beam;
pub use components::joined;
pub use continued::{Continue, Tools};
pub use data::{Data, ReducedBlock, Survey};
pub use imager::{Imager, Residual};
pub use major::{CleanProducts, clean, clean_from};
pub(crate) use output::Kind;
pub use output::{ImagingInfo, dirty_image, psf_image};
pub use pol::{DataCounts, PolSelector};
pub use restore::{gaussian, with_beam};
pub use size::SizeTuning;
pub use weights::{ImageWeights, WeightOptions, Weighting};

use crate::fourier::GridOptions;
use crate::memory::MemoryBudget;
use cittert_arrays::{Polarization, RestoringBeam};

/// How to image.
#[derive(Debug, Clone, PartialEq)]
pub struct ImagingOptions {
    /// Columns and rows; chosen from the coverage where not given.
    pub size: Option<(usize, usize)>,
    /// Cell, rad; chosen from the coverage where not given.
    pub cell_rad: Option<f64>,
    /// The product that is imaged.
    pub polarization: Polarization,
    /// Weights of the visibilities.
    pub weights: WeightOptions,
    /// Take every usable datum with weight 1 instead of the file's weights.
    pub unit_weights: bool,
    /// Number of output channels; the channels are shared out evenly, in order.
    pub channels_out: usize,
    /// Density of weights from the channels of each output channel (true) or from all channels (false).
    pub weights_per_channel_out: bool,
    /// Error of the transforms, relative.
    pub epsilon: f64,
    /// Include w (n - 1).
    pub w_term: bool,
    /// The restoring beam; fitted where not given.
    pub beam: Option<RestoringBeam>,
    /// Memory that the visibilities, the grid and their buffers share.
    pub memory: MemoryBudget,
    /// Rules for a size and a cell that are chosen from the coverage.
    pub sizes: SizeTuning,
}

impl Default for ImagingOptions {
    fn default() -> Self {
        Self {
            size: None,
            cell_rad: None,
            polarization: Polarization::I,
            weights: WeightOptions::default(),
            unit_weights: false,
            channels_out: 1,
            weights_per_channel_out: true,
            epsilon: 1e-5,
            w_term: true,
            beam: None,
            memory: MemoryBudget::default(),
            sizes: SizeTuning::default(),
        }
    }
}

impl ImagingOptions {
    pub(crate) fn grid_options(&self) -> GridOptions {
        GridOptions { epsilon: self.epsilon, w_term: self.w_term, divide_by_n: false, memory: self.memory }
    }
}
