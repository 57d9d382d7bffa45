//! From visibilities to dirty beams, dirty images and restored images, in blocks of rows.
//!
//! [`Imager`] reads a source once, chooses the grid where the caller does not, weighs, and then gives the beam, the dirty image and the
//! residual of a model for each output channel. [`clean`] runs a deconvolver around it; see [`major`].

mod ahead;
mod beam_fit;
mod cells;
mod components;
mod continued;
mod data;
mod dirty;
pub mod major;
mod options;
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
pub(crate) mod fixtures;
#[cfg(test)]
mod tests;

pub use beam_fit::fit_beam;
pub use components::joined;
pub use continued::{Continue, Tools};
pub use data::{Data, ReducedBlock, Survey};
pub use dirty::{Imager, Residual};
pub use major::{CleanProducts, clean, clean_from};
pub use options::{BeamShape, ImageSize, ImagingOptions, Weighting};
pub(crate) use output::Kind;
pub use output::{ImagingInfo, dirty_image, psf_image};
pub use pol::{DataCounts, PolSelector};
pub use restore::{gaussian, with_beam};
pub use weights::ImageWeights;
