//! Penalties that choose among the positive images that fit the data, each in its own file, and their weighted sum.
//!
//! A penalty is the negative of an entropy. It has the unit of flux, and is smallest for the image with the least structure.

mod entropy;
mod penalty;
mod total_variation;
mod weighted_sum;

pub use entropy::{Entropy, PriorEntropy, check_prior};
pub use penalty::Regulariser;
pub use total_variation::TotalVariation;
pub use weighted_sum::{L1, WeightedSum};

#[cfg(test)]
mod tests;
