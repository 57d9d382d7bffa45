//! Antenna layouts on disk: one trait, one table, and a reader that knows a file by its content.
//!
//! A layout is read with [`read_layout`] and written as text by the format's `write`; what a format cannot hold is said by `loses`, and
//! what it must have and the layout lacks is an error.

mod casa_cfg;
mod ehtim;
mod error;
mod miriad;
mod native;
mod observatories;
mod oskar;
mod pyuvsim;
mod text;
mod utm;

pub use error::LayoutError;
pub use observatories::known_site;

pub(crate) use casa_cfg::CasaCfg;
pub(crate) use ehtim::EhtimText;
pub(crate) use miriad::MiriadAnt;
pub(crate) use native::Native;
pub(crate) use oskar::OskarLayout;
pub(crate) use pyuvsim::PyuvsimCsv;

use crate::format::{Format, Holds, START_BYTES, layout_formats};
use cittert_arrays::{ArrayLayout, Site};
use std::fs;
use std::io::Read;
use std::path::Path;

/// Largest layout file that is read, bytes: 65,535 antennas need less than 20 MB in the most wordy format.
const LARGEST_FILE: u64 = 64 << 20;

/// Result of reading or writing a layout.
pub type Result<T, E = LayoutError> = std::result::Result<T, E>;

/// What a file does not say about itself.
#[derive(Debug, Clone, Default)]
pub struct ReadContext {
    /// Name of the layout where the text holds none; the reader of files sets it to the file's name.
    pub name: String,
    /// Site for formats that hold none, or in place of the one they name.
    pub site: Option<Site>,
}

/// A format of antenna layouts.
pub trait LayoutFormat: Sync {
    /// Short name, as for `--format`.
    fn name(&self) -> &'static str;

    /// Endings of file names, without the dot; the first is the usual one.
    fn extensions(&self) -> &'static [&'static str];

    /// The usual ending of file names, without the dot.
    fn extension(&self) -> &'static str {
        self.extensions()[0]
    }

    /// True for formats that are a folder, where this is one.
    fn is_folder(&self, _path: &Path) -> bool {
        false
    }

    /// One line for a table of formats.
    fn description(&self) -> &'static str;

    /// Whether the text looks like this format. `extension` decides only where the text alone cannot.
    fn sniff(&self, text: &str, extension: &str) -> bool;

    /// The layout in a text.
    ///
    /// # Errors
    /// A text that is not of this format, with the line, what was expected and what was found; a layout that is not valid.
    fn read(&self, text: &str, context: &ReadContext) -> Result<ArrayLayout>;

    /// The text of a layout; coordinates to a micrometre or better.
    ///
    /// # Errors
    /// A layout that lacks what the format must have.
    fn write(&self, layout: &ArrayLayout) -> Result<String>;

    /// What of this layout the format cannot hold, in words for the user; empty where nothing is lost.
    fn loses(&self, layout: &ArrayLayout) -> Vec<String>;
}

/// A layout is known by its text.
impl<T: LayoutFormat> Format for T {
    fn name(&self) -> &'static str {
        LayoutFormat::name(self)
    }

    fn extensions(&self) -> &'static [&'static str] {
        LayoutFormat::extensions(self)
    }

    fn description(&self) -> &'static str {
        LayoutFormat::description(self)
    }

    fn sniff(&self, path: &Path, start: &[u8]) -> bool {
        if path.is_dir() {
            return self.is_folder(path);
        }
        // The last line of what was read of a longer file may be cut, and so may its last letter.
        let whole = if start.len() < START_BYTES { start.len() } else { start.iter().rposition(|b| *b == b'\n').unwrap_or(0) };
        let Ok(text) = std::str::from_utf8(&start[..whole]) else { return false };
        LayoutFormat::sniff(self, text, &extension_of(path))
    }

    fn holds(&self) -> Holds<'_> {
        Holds::Layouts(self)
    }
}

/// The format of that name or file extension, in any case of letters.
#[must_use]
pub fn layout_format(name_or_extension: &str) -> Option<&'static dyn LayoutFormat> {
    let wanted = name_or_extension.trim_start_matches('.');
    layout_formats().find(|f| f.name().eq_ignore_ascii_case(wanted) || f.extension().eq_ignore_ascii_case(wanted))
}

/// The format that a text is in.
///
/// # Errors
/// A text of none of the formats.
pub fn sniff_layout(text: &str, extension: &str) -> Result<&'static dyn LayoutFormat> {
    layout_formats().find(|f| f.sniff(text, extension)).ok_or(LayoutError::Unknown)
}

/// Read a layout file of any known format; `site` is for formats that hold none, or replaces the one they name.
///
/// A folder is taken for an OSKAR telescope model. The site of an OSKAR layout is looked for in `position.txt` beside it.
///
/// # Errors
/// Whatever the disk says, a file that is not text or larger than 64 MiB, and everything its format refuses; each with the path.
pub fn read_layout(path: &Path, site: Option<Site>) -> Result<ArrayLayout> {
    let model = path.join("layout.txt");
    let path = if path.is_dir() && model.is_file() { model.as_path() } else { path };
    read_file(path, site).map_err(|e| LayoutError::File { path: path.to_owned(), source: Box::new(e) })
}

fn extension_of(path: &Path) -> String {
    path.extension().map(|e| e.to_string_lossy().to_lowercase()).unwrap_or_default()
}

fn read_file(path: &Path, site: Option<Site>) -> Result<ArrayLayout> {
    let text = read_text(path)?;
    let format = sniff_layout(&text, &extension_of(path))?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut context = ReadContext { name: stem, site };
    if format.name() == oskar::NAME {
        if context.name == "layout"
            && let Some(folder) = path.parent().and_then(Path::file_name)
        {
            context.name = folder.to_string_lossy().into_owned();
        }
        let position = path.with_file_name("position.txt");
        if site.is_none() && position.is_file() {
            let read = read_text(&position).and_then(|t| oskar::read_position(&t));
            context.site = Some(read.map_err(|e| LayoutError::File { path: position, source: Box::new(e) })?);
        }
    }
    format.read(&text, &context)
}

fn read_text(path: &Path) -> Result<String> {
    let file = fs::File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(LayoutError::Folder);
    }
    let mut bytes = Vec::new();
    file.take(LARGEST_FILE + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_FILE {
        return Err(LayoutError::TooLarge { limit: LARGEST_FILE });
    }
    match String::from_utf8(bytes) {
        Ok(text) if text.trim().is_empty() => Err(LayoutError::Empty),
        Ok(text) if !text.contains('\0') => Ok(text),
        _ => Err(LayoutError::NotText),
    }
}

#[cfg(test)]
mod tests;
