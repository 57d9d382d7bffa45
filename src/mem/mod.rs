//! Maximum entropy: the most featureless positive image that the data allow.
//!
//! Of all positive images whose chi squared is what the noise makes one expect, the one of largest entropy relative to a prior is chosen.
//! [`data`] holds the terms of chi squared, [`regulariser`] the entropies and other penalties, [`Objective`] their sum with its
//! Lagrange multipliers. [`MemImager`] takes an image from its prior to the target, or a few steps at a fixed multiplier for a calibration.

mod beam;
mod chi2;
mod control;
pub mod data;
mod imager;
mod memory;
mod newton;
mod objective;
mod quasi_newton;
pub mod regulariser;
pub mod vlbi;

pub use beam::BeamHessian;
pub use chi2::{ChiSquared, Misfit};
pub use control::Control;
pub use imager::{MemGoals, MemImager, MemState, Progress};
pub use objective::{Multipliers, Objective, Point};
