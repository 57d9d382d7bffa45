//! Aperture synthesis: from an array layout and a scene to visibilities, images and calibrations.

pub mod calibrate;
#[cfg(feature = "cli")]
pub mod cli;
pub mod closure;
pub mod closure_imaging;
pub mod corrupt;
pub mod deconvolve;
pub mod error;
pub mod fidelity;
#[cfg(test)]
pub(crate) mod fixtures;
pub mod fourier;
pub mod imaging;
mod linalg;
pub mod mem;
pub mod memory;
pub mod misfit;
#[cfg(feature = "cli")]
pub mod plot;
pub mod progress;
pub mod random;
pub mod simulate;
pub mod study;
pub mod values;

pub use cittert_arrays as arrays;
#[cfg(feature = "formats")]
pub use cittert_formats as formats;
pub use error::{ChainError, Result};
