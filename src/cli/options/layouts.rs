//! Antenna layouts by name or from files.

use crate::cli::failure::{Context as _, Result};
use cittert_arrays::{ArrayLayout, BuiltinLayout};
use std::path::Path;

/// A built-in layout by name, or a layout file.
///
/// # Errors
/// The text is neither a name nor a file, or the file is not a layout.
pub fn load_layout(name: &str) -> Result<ArrayLayout> {
    let path = Path::new(name);
    if BuiltinLayout::find(name).is_none() && path.exists() {
        return Ok(cittert_formats::layouts::read_layout(path, None)?);
    }
    ArrayLayout::builtin(name).context(format!("{name:?} is neither a layout file nor a built-in layout"))
}
