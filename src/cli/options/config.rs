//! The configuration of `run` and `study`, and the folder of their results.

use crate::cli::failure::{Failure, Result};
use clap::Args;
use std::path::{Path, PathBuf};

/// A configuration file and what to do with it.
#[derive(Debug, Args)]
pub struct ConfigArgs {
    /// The configuration, as TOML.
    #[arg(value_name = "CONFIG.toml", required_unless_present = "schema")]
    config: Option<PathBuf>,
    /// Folder of the results. `study` continues an unfinished study of the same configuration in it.
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["schema", "check"])]
    output: Option<PathBuf>,
    /// Print the JSON schema of the configuration and stop.
    #[arg(long)]
    pub schema: bool,
    /// Check the configuration, list the commands of a run or count the trials of a study, and stop.
    #[arg(long)]
    check: bool,
}

impl ConfigArgs {
    /// The path of the configuration and its text.
    ///
    /// # Errors
    /// A file that cannot be read.
    pub fn read(&self) -> Result<(&Path, String)> {
        let path = self.config.as_deref().ok_or_else(|| Failure::usage("give a configuration file"))?;
        Ok((path, cittert_formats::read_text(path)?))
    }

    /// The folder of the results; `None` where the configuration is only checked.
    #[must_use]
    pub fn folder(&self) -> Option<&Path> {
        self.output.as_deref().filter(|_| !self.check)
    }
}
