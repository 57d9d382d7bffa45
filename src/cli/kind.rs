//! The kind of a file, recognised by its content.

use super::failure::{Failure, Result};
use std::path::Path;

/// Kinds of files that cittert reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum FileKind {
    /// Visibilities.
    Visibilities,
    /// An image.
    Image,
    /// A gain table.
    Gains,
    /// An antenna layout.
    Layout,
}

/// The kind of a file.
///
/// # Errors
/// A file that is missing, empty, or of no known format. The message says what it seems to be.
pub(super) fn kind_of(path: &Path) -> Result<FileKind> {
    let failure: Failure = match cittert_formats::visibility_format(path) {
        Ok(_) => return Ok(FileKind::Visibilities),
        Err(e) => e.into(),
    };
    if cittert_formats::image_format(path).is_ok() {
        return Ok(FileKind::Image);
    }
    if cittert_formats::calh5::is_gains(path) {
        return Ok(FileKind::Gains);
    }
    // Of the formats that are left, a layout is the only one that is text.
    let text = std::fs::read(path).ok().and_then(|b| String::from_utf8(b).ok()).filter(|t| !t.trim().is_empty());
    if text.is_some() || path.join("layout.txt").is_file() {
        return Ok(FileKind::Layout);
    }
    Err(failure)
}
