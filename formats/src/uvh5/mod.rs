//! UVH5, the native format: HDF5 with the groups `Header` and `Data`, version 1.2.
//!
//! # Reference
//! Hazelton et al. 2017, JOSS 2, 140 (pyuvdata); the UVH5 memo of that project.

mod annotations;
mod edit;
mod format;
mod header;
mod layout;
mod names;
mod near_field;
mod pattern;
mod phase;
mod read;
mod unread;
mod write;

pub use names::NOMINAL_SITE;
pub use read::Uvh5Reader;
pub use write::Uvh5Writer;

pub(crate) use format::Uvh5;
pub(crate) use header::{read_spectrum, write_spectrum};
pub(crate) use layout::{read_telescope, site_of, unique_names, write_telescope};
pub(crate) use phase::Sky;
