//! Dirty beams, dirty images and restored images of visibilities, in blocks of rows.
//!
//! [`Imager`] reads a source once, chooses the grid if the caller does not, and makes the weights. It then makes the dirty beam, the dirty image
//! and the residual of a model for each output channel. [`clean`] runs a deconvolver in major cycles; see [`major`].

mod ahead;
mod at_once;
mod auto_mask;
mod background;
mod banded;
mod beam_fit;
mod cells;
mod channel_cycles;
mod cleaned;
mod clock;
mod components;
mod continued;
mod corrected;
mod data;
mod delta_t;
mod imager;
pub mod major;
mod mean_from;
mod minor_cycles;
mod near;
mod near_passes;
#[cfg(test)]
mod near_tests;
mod one_pass;
mod opened;
mod options;
mod outlook;
mod output;
mod over_ranks;
mod places_of_rows;
mod pol;
mod products;
mod psf;
mod reduction;
mod restore;
mod row_weights;
mod session;
mod size;
mod size_tuning;
mod split;
mod still_feeds;
mod survey;
mod total_power;
mod trust;
mod weighed_rows;
pub mod weights;

#[cfg(test)]
mod cycle_tests;
#[cfg(test)]
mod delta_t_tests;
#[cfg(test)]
mod memory_tests;
#[cfg(test)]
mod part_tests;
#[cfg(test)]
mod pattern_tests;
#[cfg(test)]
mod rank_tests;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod total_power_tests;
#[cfg(test)]
mod trust_tests;
#[cfg(test)]
mod tuning_tests;

pub use background::{Background, BackgroundFrom};
pub use beam_fit::fit_beam;
pub use cittert_arrays::Weighting;
pub(crate) use cleaned::CleanReport;
pub(crate) use clock::Clock;
pub use components::joined;
pub use continued::{Continue, Tools};
pub use corrected::{CorrectionOptions, pattern_image};
pub use data::Data;
pub(crate) use data::rows_of_one_pass;
pub use delta_t::{DeltaT, delta_t};
pub use imager::{ImageMisfit, Imager, Residual};
pub(crate) use major::cleaned as clean_once;
pub use major::{CleanProducts, StopReason, clean, clean_from};
pub use mean_from::MeanFrom;
pub use options::{BeamShape, ImageSize, ImagingOptions};
pub use outlook::{Field, Outlook, PassCounts, RowSample};
pub(crate) use output::Kind;
pub use output::{PATTERN_LIMIT, dirty_image, psf_image};
pub(crate) use over_ranks::{finished, summed};
pub use pol::{DataCounts, PolSelector};
pub use products::Products;
pub use reduction::ReducedBlock;
pub use restore::{gaussian, with_beam};
pub use row_weights::RowWeights;
pub(crate) use size::warn_coarse;
pub use size_tuning::SizeTuning;
pub use split::BackgroundChoice;
pub use still_feeds::StillFeeds;
pub use survey::Survey;
pub use total_power::{TotalPower, ZeroSpacing};
pub use weighed_rows::WeighedRows;
pub use weights::ImageWeights;
