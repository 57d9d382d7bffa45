//! Placeholder.
pub mod atmosphere;
pub mod constants;
