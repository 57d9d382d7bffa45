//! Terms of chi squared over model visibilities.
//!
//! An image is transformed to visibilities once. Every term compares them with its data and adds its gradient. The sum of the gradients is
//! transformed back once. Any number of terms therefore takes one pair of transforms.

mod term;
mod visibilities;

pub use term::VisibilityTerm;
#[cfg(test)]
pub(crate) use term::check;
pub use visibilities::Visibilities;
