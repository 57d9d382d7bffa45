//! Antenna layouts by name or from files.

use crate::cli::failure::{Context as _, Failure, Result, ensure};
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

/// As [`load_layout`], for commands that need baselines.
///
/// # Errors
/// As [`load_layout`], and a layout with fewer than two antennas.
pub fn load_array(name: &str) -> Result<ArrayLayout> {
    let layout = load_layout(name)?;
    let count = layout.n_ant();
    ensure!(count >= 2, Failure::message(format!("{name}: number of antennas is {count}, expected at least two, to form a baseline")));
    Ok(layout)
}
