//! The only module that calls the HDF5 library. UVH5 and CalH5 share it.
//!
//! A damaged file may claim any shape. Before memory is allocated for an array, its size is therefore compared with the size of the file.

mod change;
mod child;
mod chunks;
mod contiguous;
mod convert;
mod failure;
mod flaws;
mod keyword;
mod objects;
mod parts;
mod places;
mod probe;
mod read;
mod sharing;
mod strings;
mod unpack;
mod write;

pub(crate) use change::Stored;
pub(crate) use parts::Three;
pub(crate) use places::raw::SIGNATURE;
pub(crate) use probe::{has, open, probe_together};
pub(crate) use read::H5In;
pub(crate) use sharing::side_by_side;
pub use write::Compression;
pub(crate) use write::{H5Out, Rows};
