//! UVFITS: visibilities as FITS random groups with AIPS tables.
//!
//! On disk a baseline is r1 - r2 in seconds of light time and visibilities are the conjugates of ours; both signs are turned here
//! and nowhere else.
//!
//! # Reference
//! Greisen 2020, AIPS Memo 117.

mod antennas;
mod axes;
mod export;
mod format;
mod groups;
mod phase;
mod read;
mod tables;
mod write;

pub use read::UvfitsReader;
pub use write::{UvfitsOptions, UvfitsWriter};

pub(crate) use format::Uvfits;
