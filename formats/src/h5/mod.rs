//! HDF5: the only place that speaks to the library, shared by UVH5 and CalH5.
//!
//! Everything that is read whole is bounded by the size of the file before memory is asked for it, because a file may claim any shape.

mod child;
mod chunks;
mod contiguous;
mod convert;
mod failure;
mod flaws;
mod probe;
mod read;
mod strings;
mod unpack;
mod write;

pub(crate) use probe::{has, open};
pub(crate) use read::{H5In, SIGNATURE};
pub use write::Compression;
pub(crate) use write::{H5Out, Rows};
