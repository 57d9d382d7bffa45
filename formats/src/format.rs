//! The one table of formats: a row each, found by content and not by name.
//!
//! What every format has is [`Format`]; what one can do is in what it [`Holds`]. Reading, `info`, the command line, the book's table and the
//! test of conformance all go through [`FORMATS`]; a new format is a file and a row.

use crate::calh5::CalH5;
use crate::contents::Contents;
use crate::files::{open_file, read_up_to};
use crate::layouts::{self, LayoutFormat};
use crate::registry::{FitsImage, ImageFormat, Uvfits, Uvh5, VisibilityFormat};
use crate::sources::SourceList;
use crate::{FormatError, Result};
use cittert_arrays::{GainTable, Source};
use std::path::Path;

/// A format of files.
pub trait Format: Sync {
    /// Name, such as `UVH5`.
    fn name(&self) -> &'static str;

    /// Endings of file names, without the dot; the first is the usual one.
    fn extensions(&self) -> &'static [&'static str];

    /// What it is and what it holds, in one sentence.
    fn description(&self) -> &'static str;

    /// True where the content of the file is of this format; `start` holds its first bytes, and is empty for a folder.
    fn sniff(&self, path: &Path, start: &[u8]) -> bool;

    /// What its files hold, with what reads and writes them.
    fn holds(&self) -> Holds<'_>;
}

/// What a format holds.
#[derive(Clone, Copy)]
pub enum Holds<'a> {
    /// Visibilities.
    Visibilities(&'a dyn VisibilityFormat),
    /// Images and cubes.
    Images(&'a dyn ImageFormat),
    /// Antenna gains.
    Gains(&'a dyn GainFormat),
    /// Lists of sources.
    Sources(&'a dyn SourceFormat),
    /// Antenna layouts.
    Layouts(&'a dyn LayoutFormat),
}

impl Holds<'_> {
    /// In a word, for tables.
    #[must_use]
    pub fn name(&self) -> &'static str {
        match self {
            Self::Visibilities(_) => "visibilities",
            Self::Images(_) => "images",
            Self::Gains(_) => "gains",
            Self::Sources(_) => "sources",
            Self::Layouts(_) => "layouts",
        }
    }
}

/// A format of gain tables.
pub trait GainFormat: Format {
    /// Read a table.
    ///
    /// # Errors
    /// Whatever is wrong with the file, with the place in it.
    fn read(&self, path: &Path) -> Result<GainTable>;

    /// Write a table.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, or whatever the disk says.
    fn write(&self, path: &Path, table: &GainTable, overwrite: bool) -> Result<()>;
}

/// A format of source lists.
pub trait SourceFormat: Format {
    /// Read a list.
    ///
    /// # Errors
    /// Whatever is wrong with the file, with the line.
    fn read(&self, path: &Path) -> Result<Vec<Source>>;

    /// Write a list.
    ///
    /// # Errors
    /// An existing output that may not be overwritten, or whatever the disk says.
    fn write(&self, path: &Path, sources: &[Source], overwrite: bool) -> Result<()>;
}

/// All formats, in the order in which they are tried.
pub static FORMATS: &[&dyn Format] = &[
    &Uvh5,
    &Uvfits,
    #[cfg(feature = "ms")]
    &crate::ms::MeasurementSet,
    &CalH5,
    &FitsImage,
    &SourceList,
    &layouts::Native,
    &layouts::CasaCfg,
    &layouts::PyuvsimCsv,
    &layouts::EhtimText,
    &layouts::MiriadAnt,
    &layouts::OskarLayout,
];

/// All formats of visibilities.
pub fn visibility_formats() -> impl Iterator<Item = &'static dyn VisibilityFormat> {
    FORMATS.iter().filter_map(|f| if let Holds::Visibilities(v) = f.holds() { Some(v) } else { None })
}

/// All formats of images.
pub fn image_formats() -> impl Iterator<Item = &'static dyn ImageFormat> {
    FORMATS.iter().filter_map(|f| if let Holds::Images(i) = f.holds() { Some(i) } else { None })
}

/// All formats of layouts, in the order in which they are tried.
pub fn layout_formats() -> impl Iterator<Item = &'static dyn LayoutFormat> {
    FORMATS.iter().filter_map(|f| if let Holds::Layouts(l) = f.holds() { Some(l) } else { None })
}

/// The format of a file or folder, by its content.
///
/// # Errors
/// A file that is missing, empty or of no known format; the error says what it seems to be.
pub fn format_of(path: &Path) -> Result<&'static dyn Format> {
    let start = if path.is_dir() { Vec::new() } else { start_of(path)? };
    let found = FORMATS.iter().find(|f| f.sniff(path, &start)).copied();
    found.ok_or_else(|| FormatError::NotA {
        path: path.into(),
        expected: names(FORMATS.iter().map(|f| (f.name(), f.extensions()))),
        found: format!("it is {}", if path.is_dir() { "a folder without a set".into() } else { describe(&start) }),
    })
}

/// What is in a file.
pub(crate) fn sum_up(format: &'static dyn Format, path: &Path) -> Result<Contents> {
    match format.holds() {
        Holds::Visibilities(f) => Contents::visibilities(format.name(), f.open(path)?.as_mut(), path),
        Holds::Images(f) => Ok(Contents::image(format.name(), &f.read(path)?)),
        Holds::Gains(f) => Ok(Contents::gains(format.name(), &f.read(path)?)),
        Holds::Sources(f) => Ok(Contents::sources(&f.read(path)?)),
        Holds::Layouts(_) => Ok(Contents::layout(&layouts::read_layout(path, None)?)),
    }
}

/// The first bytes of a file: enough for any header that is looked at.
pub(crate) fn start_of(path: &Path) -> Result<Vec<u8>> {
    let mut start = vec![0; START_BYTES];
    let n = read_up_to(&mut open_file(path)?, &mut start).map_err(|e| FormatError::io(path, "read", e))?;
    start.truncate(n);
    Ok(start)
}

/// Bytes that formats are known by.
pub(crate) const START_BYTES: usize = 2880 * 4;

/// What a file seems to be, for the error that says it is not what was asked for.
pub(crate) fn describe(start: &[u8]) -> String {
    let known: [(&[u8], &str); 8] = [
        (b"\x89PNG", "a PNG picture"),
        (b"\xff\xd8\xff", "a JPEG picture"),
        (crate::h5::SIGNATURE, "an HDF5 file without visibilities"),
        (b"SIMPLE  =", "a FITS file"),
        (b"\x1f\x8b", "a gzip-compressed file"),
        (b"PK\x03\x04", "a zip archive"),
        (b"%PDF", "a PDF document"),
        (b"BZh", "a bzip2-compressed file"),
    ];
    if let Some((_, name)) = known.iter().find(|(magic, _)| start.starts_with(magic)) {
        return (*name).into();
    }
    let head = &start[..start.len().min(16)];
    let shown: String = head.iter().map(|b| b.escape_ascii().to_string()).collect();
    let text = start.iter().take(512).all(|b| *b >= 32 || b.is_ascii_whitespace());
    format!("{} that begins with \"{shown}\"", if text { "a text" } else { "a file of unknown kind" })
}

/// Names of formats with their usual endings, for messages.
pub(crate) fn names<'a>(all: impl Iterator<Item = (&'a str, &'a [&'a str])>) -> String {
    all.map(|(name, ends)| format!("{name} (.{})", ends[0])).collect::<Vec<_>>().join(", ")
}
