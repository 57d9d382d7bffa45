//! Deconvolvers: they turn a residual and a dirty beam into components.
//!
//! A deconvolver runs the minor cycles between two major cycles (see [`crate::imaging::major`]). It removes components from the residual until
//! the peak is at a given level or the iterations are used. A new deconvolver needs a file in this folder and a row in [`TABLE`] below. The names,
//! the help texts and the documentation come from the table.

mod clark;
mod crew;
mod hogbom;
mod minor;
mod multiscale;
mod options;
#[cfg(test)]
mod tests;
mod tile_loops;
mod tiled_beam;
mod tiles;
mod tuning;

pub use minor::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, Scales};
pub(crate) use minor::{largest_where, peak_size};
pub(crate) use multiscale::chosen as chosen_scales;
pub use options::{Algorithm, CleanOptions, SkyBox};
pub use tuning::CleanTuning;

use crate::{ChainError, Result};
use ndarray::ArcArray2;

/// Function that makes a deconvolver for a dirty beam \[m, l\] with its peak of 1 at the centre pixel. The deconvolver shares the memory of
/// the beam.
pub type Make = fn(&ArcArray2<f32>, &Scales, &CleanTuning) -> Result<Box<dyn Deconvolver>>;

/// One row of the table of deconvolvers.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Its name.
    pub name: &'static str,
    /// Function that makes it.
    pub make: Make,
}

/// Name of the deconvolver for extended structure, the only one that has scales.
pub(crate) const EXTENDED: &str = "multiscale";

/// All deconvolvers.
pub const TABLE: [Entry; 3] = [
    // Exact point components over the whole image. Högbom 1974, A&AS 15, 417.
    Entry { name: "hogbom", make: hogbom::make },
    // Point components among the brightest pixels with a patch of the beam, corrected by FFT. Clark 1980, A&A 89, 377.
    Entry { name: "clark", make: clark::make },
    // Components of several widths, for extended emission. Cornwell 2008, IEEE JSTSP 2, 793.
    Entry { name: EXTENDED, make: multiscale::make },
];

/// The names of all deconvolvers, with commas between.
pub(crate) fn names() -> String {
    TABLE.map(|e| e.name).join(", ")
}

/// The deconvolver with this name.
///
/// # Errors
/// The name is not in the table.
pub fn by_name(name: &str) -> Result<&'static Entry> {
    TABLE.iter().find(|e| e.name == name).ok_or_else(|| ChainError::bad_option("algorithm", name, names()))
}
