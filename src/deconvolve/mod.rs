//! Deconvolvers: they turn a residual and a dirty beam into components.
//!
//! A deconvolver runs the minor cycles between two major cycles (see [`crate::imaging::major`]). It removes components from the residual until
//! the peak is at a given level or the iterations are used. A new deconvolver needs a file in this folder and a row in [`TABLE`]. The names,
//! the help texts and the documentation come from the table.

mod clark;
mod hogbom;
mod minor;
mod multiscale;
mod options;
mod table;
#[cfg(test)]
mod tests;
mod tiles;
mod tuning;

pub(crate) use minor::peak_size;
pub use minor::{Component, Deconvolver, Minor, MinorLimits, MinorReport, MinorStop, Scales};
pub use options::{Algorithm, CleanOptions, SkyBox};
pub use table::{Entry, Make, TABLE, by_name};
pub use tuning::CleanTuning;
