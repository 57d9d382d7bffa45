//! A verdict on every fit: is the image, with its gains, supported by the data?
//!
//! An image may look sharp and have a high dynamic range, and yet be wrong. What the data say about it is in the residual visibilities
//! ([`Residuals`]): their size against the noise, the antennas and samples that stand out, and the baselines that see more flux than the image
//! holds. What physics says is in the image itself: no negative brightness, and no brightness beyond what the visibilities allow.
//! Each rule that is broken gives a [`Finding`] that says what was seen and what to try next.

mod antenna_errors;
mod finding;
mod gains;
mod images;
mod misfits;
mod outside;
mod pedestals;
mod prediction;
mod residuals;
mod samples;
#[cfg(test)]
mod tests;

pub use antenna_errors::{AntennaErrors, Explained};
pub use finding::{Finding, sentence};
pub use gains::{not_determined, of_gains};
pub use images::{ImageFacts, Levels, of_image};
pub use misfits::{left_beyond_noise, of_residuals, something_is_left};
pub use outside::{Outside, look_outside};
pub use pedestals::of_pedestal;
pub use prediction::CrossCheck;
pub use residuals::{Residuals, Spectrum};
