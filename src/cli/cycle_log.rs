//! `--log`: the file to which each cycle or step is written.

use super::context::Context;
use super::failure::{Context as _, Result};
use super::ranks::is_silent;
use cittert_formats::atomic::is_private;
use std::fs::OpenOptions;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;

/// Write each cycle or step as one line of JSON to `path`, where a path is given. The file is a claimed output. It does not wait for the other
/// outputs, so that a long run can be followed.
///
/// # Errors
/// An error of the file system.
pub(super) fn open(path: Option<&Path>, context: &Context) -> Result<()> {
    let Some(path) = path.filter(|_| !is_silent()) else { return Ok(()) };
    let mode = if is_private() { 0o600 } else { 0o666 };
    let file = OpenOptions::new().write(true).create(true).truncate(true).mode(mode).open(path);
    context.console.log_cycles(path, file.context(format!("{}: cannot write the log", path.display()))?);
    Ok(())
}
