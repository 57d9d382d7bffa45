//! Everything on disk, and every sign flip.

pub mod atomic;
pub mod fits;
mod error;
#[cfg(feature = "ms")]
pub mod ms;
mod time;

pub use error::{FormatError, Result};
