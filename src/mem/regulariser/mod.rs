//! Penalties that choose among the positive images that fit the data, one a file, and their weighted sum.
//!
//! A penalty is the negative of an entropy, has the unit of flux, and is smallest at the most featureless image.

mod burg;
mod gull_skilling;
mod l1;
mod penalty;
mod relative;
mod table;
#[cfg(test)]
mod tests;
mod total_variation;
mod weighted_sum;

pub use burg::Burg;
pub use gull_skilling::GullSkilling;
pub use l1::L1;
pub use penalty::Regulariser;
pub use relative::RelativeEntropy;
pub use table::{ENTROPIES, Entry, check_prior, entropy_by_name};
pub use total_variation::TotalVariation;
pub use weighted_sum::WeightedSum;
