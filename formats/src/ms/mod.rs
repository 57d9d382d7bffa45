//! Measurement Sets of version 2, through casacore's tables (cargo feature `ms`, system package casacore-dev).
//!
//! Imagers of Measurement Sets expect antenna 1 before antenna 2, the baseline from antenna 2 to antenna 1, and the visibilities of this
//! baseline. Compared to memory, uvw are negated and visibilities are conjugated, on reading and on writing.
//!
//! # Reference
//! Kemball & Wieringa 2000, MeasurementSet definition version 2.0 (AIPS++ Note 229).

mod annotations;
mod codes;
mod edit;
#[cfg(test)]
mod edit_tests;
mod edit_weights;
mod export;
mod ffi;
mod fields;
mod format;
mod index;
mod keywords;
mod metadata;
mod observatories;
mod own;
mod parts;
mod read;
mod rows;
mod schema;
mod subtables;
mod table;
mod unread;
mod unwritten;
mod write;

pub use format::{MeasurementSet, is_measurement_set};
pub use read::MsSource;
pub use write::MsWriter;
