//! UVFITS: visibilities as FITS random groups with AIPS tables.
//!
//! In the file a baseline is r1 - r2 in seconds of light time, and the visibilities are the complex conjugates of those in memory. Only this
//! module converts these signs.
//!
//! # Reference
//! Greisen 2020, AIPS Memo 117.

mod annotations;
mod antennas;
mod axes;
mod edit;
mod export;
mod format;
mod groups;
mod phase;
mod read;
mod tables;
mod unread;
mod write;

pub use read::UvfitsReader;
pub use write::{UvfitsOptions, UvfitsWriter};

pub(crate) use format::Uvfits;
