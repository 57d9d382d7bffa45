//! Layout files: their formats, and a reader that recognises a file by its content.

use super::casa_cfg::CasaCfg;
use super::ehtim::EhtimText;
use super::error::{LayoutError, ReadContext, Result};
use super::miriad::MiriadAnt;
use super::native::Native;
use super::oskar::{self, OskarLayout};
use super::pyuvsim::PyuvsimCsv;
use super::spreadsheet::Spreadsheet;
use crate::files::{LARGEST_TEXT, extension_of, refuse_special};
use crate::format::{Format, Holds, LayoutFormat};
use cittert_arrays::{ArrayLayout, Site};
use std::fs;
use std::io::Read;
use std::path::Path;

/// All formats of layouts, in the order in which they are tried.
pub(crate) static LAYOUTS: &[&dyn Format] = &[&Native, &CasaCfg, &PyuvsimCsv, &Spreadsheet, &EhtimText, &MiriadAnt, &OskarLayout];

/// All formats of layouts, in the order in which they are tried.
pub fn layout_formats() -> impl Iterator<Item = &'static dyn LayoutFormat> {
    LAYOUTS.iter().filter_map(|f| if let Holds::Layouts(l) = f.holds() { Some(l) } else { None })
}

/// The format with this name or usual file ending, in upper or lower case.
#[must_use]
pub fn layout_format(name_or_extension: &str) -> Option<&'static dyn LayoutFormat> {
    let wanted = name_or_extension.trim_start_matches('.');
    layout_formats().find(|f| f.name().eq_ignore_ascii_case(wanted) || f.extension().eq_ignore_ascii_case(wanted))
}

/// The format of a text.
///
/// # Errors
/// A text that has none of the known formats.
pub fn sniff_layout(text: &str, extension: &str) -> Result<&'static dyn LayoutFormat> {
    layout_formats().find(|f| f.sniff(text, extension)).ok_or(LayoutError::Unknown)
}

/// Read a layout file of any known format. `site` is the site for formats that hold none; it replaces the site that a file names.
///
/// A directory is read as an OSKAR telescope model. The site of an OSKAR layout is read from `position.txt` in the same directory.
///
/// # Errors
/// An error of the file system, a file that is not text or is larger than 64 MiB, or an error in the text; each with the path.
pub fn read_layout(path: &Path, site: Option<Site>) -> Result<ArrayLayout> {
    let model = path.join("layout.txt");
    let path = if path.is_dir() && model.is_file() { model.as_path() } else { path };
    read_file(path, site).map_err(|e| LayoutError::File { path: path.to_owned(), source: Box::new(e) })
}

fn read_file(path: &Path, site: Option<Site>) -> Result<ArrayLayout> {
    let text = read_text(path)?;
    let format = sniff_layout(&text, &extension_of(path))?;
    let stem = path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default();
    let mut context = ReadContext { name: stem, site, folder: path.parent().map(Path::to_path_buf) };
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
    refuse_special(path).map_err(|e| LayoutError::Special(e.to_string()))?;
    let file = fs::File::open(path)?;
    if file.metadata()?.is_dir() {
        return Err(LayoutError::Folder);
    }
    let mut bytes = Vec::new();
    file.take(LARGEST_TEXT + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LARGEST_TEXT {
        return Err(LayoutError::TooLarge { limit: LARGEST_TEXT });
    }
    match String::from_utf8(bytes) {
        Ok(text) if text.trim().is_empty() => Err(LayoutError::Empty),
        Ok(text) if !text.contains('\0') => Ok(text),
        _ => Err(LayoutError::NotText),
    }
}
