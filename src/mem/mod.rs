//! Maximum entropy: the positive image with the least structure that agrees with the data.
//!
//! Of all positive images whose chi squared has its expected value, the image of largest entropy relative to a prior is chosen.
//! [`crate::misfit`] holds the terms of chi squared, [`regulariser`] the entropies and other penalties, [`Objective`] their sum with its
//! Lagrange multipliers. [`MemImager`] goes from the prior to the target, or takes a few steps at a fixed multiplier for a calibration.

mod beam;
mod certificate;
mod chi2;
mod control;
mod data_term;
mod fluctuations;
mod imager;
mod inside;
mod listed;
mod memory;
mod newton;
mod noise;
mod objective;
mod options;
mod passes;
#[cfg(test)]
mod pattern_tests;
mod pipeline;
mod plan;
mod power_plane;
mod quasi_newton;
#[cfg(test)]
mod rank_tests;
pub mod regulariser;
mod response;
mod signal;
mod smooth_scene;
mod smoothness;
mod solver;
mod statistics;
#[cfg(test)]
mod tests;
mod tuning;
mod uncertainty;
mod vtess;

pub use beam::BeamHessian;
pub use certificate::Certificate;
pub use chi2::ChiSquared;
pub use control::Control;
pub use imager::{MemImager, MemState, Method};
pub(crate) use inside::{in_front, sum_inside};
pub use noise::{HandsNoise, HandsSum, Noise, noise_from_hands};
pub(crate) use objective::single;
pub use objective::{Multipliers, Objective, Point};
pub use options::{MemOptions, NoiseChoice, PriorChoice, SmoothnessChoice};
pub use pipeline::{MemProducts, flux_of_one, mem};
pub(crate) use pipeline::{level_prior, prepared};
pub use plan::{Flux, MemInputs, MemPlan, Prior, announce_noise};
pub use regulariser::Entropy;
pub use response::Response;
pub use signal::chi2_of_nothing;
pub(crate) use smooth_scene::{Known, SmoothScene};
pub use smoothness::Smoothness;
pub use solver::{MemGoals, Progress};
pub use statistics::DataSums;
pub use tuning::{MemControl, MemTuning, VtessControl};
pub use uncertainty::{Uncertainty, uncertainty};
