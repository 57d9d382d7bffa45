//! Everything on disk, and every sign flip.

pub mod atomic;
mod error;
pub mod time;

pub use error::{FormatError, Result};
