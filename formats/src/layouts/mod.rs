//! Antenna layouts on disk: one file for each format, and a reader that recognises a file by its content.
//!
//! [`read_layout`] reads a layout. The `write` of a format gives its text; `loses` says what the format cannot hold. A layout that lacks
//! something that the format needs is an error.

mod casa_cfg;
mod ehtim;
pub(crate) mod error;
mod file;
mod miriad;
mod native;
mod observatories;
mod oskar;
mod pyuvsim;
mod spreadsheet;
mod text;
mod utm;

pub use crate::format::LayoutFormat;
pub use error::{LayoutError, ReadContext, Result};
pub use file::{layout_format, layout_formats, read_layout, sniff_layout};
pub use observatories::known_site;

pub(crate) use file::LAYOUTS;

#[cfg(test)]
mod tests;
