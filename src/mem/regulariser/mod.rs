//! Penalties that choose among the positive images that fit the data, each in its own file, and their weighted sum.
//!
//! A penalty is the negative of an entropy. It has the unit of flux, and is smallest for the image with the least structure.

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
