//! `--log`: the file to which each cycle or step is written.

use super::context::Context;
use super::failure::{Context as _, Result};
use super::options::OutputArgs;
use std::fs::File;
use std::path::Path;

/// Write each cycle or step as one line of JSON to `path`, where a path is given.
///
/// # Errors
/// A file that may not be replaced, or an error of the file system.
pub(super) fn open(path: Option<&Path>, out: &OutputArgs, context: &Context) -> Result<()> {
    let Some(path) = path else { return Ok(()) };
    out.check(path)?;
    let file = File::create(path).context(format!("{}: cannot write the log", path.display()))?;
    context.console.log_cycles(file);
    Ok(())
}
