//! Maximum entropy: the most featureless positive image that the data allow.

pub mod data;
pub mod vlbi;
