//! Deconvolvers: they turn a residual and a dirty beam into components.
//!
//! A deconvolver runs the minor cycles between two major cycles (see [`crate::imaging::major`]). It removes components from the residual until
//! the peak is at a given level or the iterations are used. A new deconvolver needs a file in this folder and a row in [`TABLE`]. The names,
//! the help texts and the documentation come from the table.

mod clark;
mod hogbom;
mod minor;
mod multiscale;
mod table;
#[cfg(test)]
mod tests;
mod tiles;
mod tuning;

pub(crate) use minor::peak_size;
pub use minor::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop};
pub use table::{Entry, Make, TABLE, by_name};
pub use tuning::CleanTuning;

/// Settings of the deconvolvers.
#[derive(Debug, Clone, PartialEq)]
pub struct DeconvolveOptions {
    /// Scales in pixels for multiscale, 0 for points; chosen from the beam and the size where empty.
    pub scales_px: Vec<f64>,
    /// How much small scales are favoured: a scale s competes with its peak times 1 - bias s / largest.
    pub scale_bias: f64,
    /// Width of the main lobe in pixels, for scales that are chosen.
    pub beam_px: f64,
}

impl Default for DeconvolveOptions {
    fn default() -> Self {
        Self { scales_px: Vec::new(), scale_bias: 0.3, beam_px: 4.0 }
    }
}
