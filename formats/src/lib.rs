//! Everything on disk, and every sign flip.

pub mod atomic;
pub mod fits;
mod error;
mod time;

pub use error::{FormatError, Result};
