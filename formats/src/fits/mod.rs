//! FITS: headers, images and binary tables, without an external library.
//!
//! # Reference
//! Pence et al. 2010, A&A 524, A42 (FITS 3.0); Greisen & Calabretta 2002, A&A 395, 1061; Calabretta & Greisen 2002, A&A 395, 1077.

mod celestial;
mod format;
mod header;
mod image_axes;
mod image_read;
mod image_write;
mod input;
mod linear;
mod near_field;
mod number;
pub(crate) mod table;

pub use image_read::read_image;
pub use image_write::{ImageOptions, write_image};
pub use linear::{LinearAxis, write_plane};

pub(crate) use format::{FitsImage, is_random_groups};
pub(crate) use header::{Header, HeaderWriter, Value};
pub(crate) use input::{Input, padding};
pub(crate) use near_field::{near_field, write_near_field};
pub(crate) use number::{Number, scaled};
