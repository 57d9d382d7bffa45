//! All file formats, and all conversions of signs and conventions between files and memory.
//!
//! | module | format |
//! |---|---|
//! | [`uvh5`] | UVH5, the native format of visibilities |
//! | [`uvfits`] | UVFITS random groups |
//! | `ms` | Measurement Sets (feature `ms`) |
//! | [`fits`] | FITS images, cubes and planes |
//! | [`calh5`] | CalH5 gain tables |
//! | [`layouts`] | antenna layouts of several programs |
//! | [`read_pattern`] | power patterns of antennas: CSV, FITS tables, beam files of pyuvdata |
//! | [`read_pointings`], [`read_band`] | where antennas point, and responses of receivers, as CSV |
//! | [`info`] | summaries of files |
//! | [`atomic`] | outputs that get their name only when complete |
//!
//! One table, [`FORMATS`], lists all formats. A file is recognised by its content. A new format is a file or directory and a row.

pub mod atomic;
mod bands;
mod builtin;
pub mod calh5;
mod columns;
mod contents;
mod disk;
mod drift;
mod error;
mod files;
pub mod fits;
mod format;
mod grid;
mod h5;
pub mod info;
mod joined;
pub mod layouts;
mod lines;
#[cfg(feature = "ms")]
pub mod ms;
mod patterns;
mod picture;
mod pointings;
mod registry;
mod sources;
mod table;
mod time;
pub mod uvfits;
pub mod uvh5;

pub use bands::{read_band, write_receivers};
pub use columns::{ColumnSink, CreateOptions, Created, Edit, VisColumn};
pub use contents::{Contents, LayoutInfo, SourceListInfo};
pub use disk::free_disk;
pub use error::{FormatError, Result};
pub use files::{read_text, refuse_special};
pub use format::{Format, GainFormat, Holds, ImageFormat, Label, SourceFormat, VisibilityFormat};
pub use grid::write_grid;
pub use h5::Compression;
pub use joined::JoinedSource;
pub use layouts::layout_formats;
pub use patterns::read_pattern;
pub use picture::read_grey_png;
pub use pointings::{is_pointings, read_pointings, write_pointings};
pub use registry::{
    create_visibilities, create_visibilities_with, edit_visibilities, format_of, format_of_output, format_to_write, image_format, losses,
    open_column, open_image, open_visibilities, visibility_format, visibility_formats,
};
pub use sources::{read_sources, write_sources};
pub use table::{Column, Table, write_tables};

use std::sync::LazyLock;

/// All formats, in the order in which they are tried.
pub static FORMATS: LazyLock<Vec<&'static dyn Format>> = LazyLock::new(|| {
    let others: &[&dyn Format] = &[
        &uvh5::Uvh5,
        &uvfits::Uvfits,
        #[cfg(feature = "ms")]
        &ms::MeasurementSet,
        &calh5::CalH5,
        &fits::FitsImage,
        &sources::SourceList,
    ];
    [others, layouts::LAYOUTS].concat()
});
