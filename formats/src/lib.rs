//! Everything on disk, and every sign flip.

pub mod atomic;
mod error;
mod files;
pub mod fits;
mod h5;
#[cfg(feature = "ms")]
pub mod ms;
mod time;
pub mod uvh5;

pub use error::{FormatError, Result};
pub use h5::Compression;
