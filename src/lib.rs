//! Aperture synthesis: from an array layout and a scene to visibilities, images and calibrations.

pub mod calibrate;
pub mod deconvolve;
pub mod error;
pub mod fourier;
pub mod imaging;
pub mod progress;

pub use error::{ChainError, Result};
