//! Aperture synthesis: from an array layout and a scene to visibilities, images and calibrations.

pub mod cli;
pub mod error;
pub mod fidelity;
pub mod fourier;
pub mod plot;
pub mod progress;
pub mod simulate;

pub use error::{ChainError, Result};
