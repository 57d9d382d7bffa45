//! The options of `mem`.

use crate::cli::options::{ColumnArgs, OutputArgs};
use crate::closure_imaging::ClosureImagingOptions;
use crate::imaging::ImagingOptions;
use crate::mem::MemOptions;
use clap::Args;
use std::path::PathBuf;

/// Options of `mem`.
#[derive(Debug, Args)]
pub struct MemCommandArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    pub(super) input: PathBuf,
    #[command(flatten)]
    pub(super) column: ColumnArgs,
    #[command(flatten)]
    pub(super) imaging: ImagingOptions,
    #[command(flatten)]
    pub(super) mem: MemOptions,
    #[command(flatten)]
    pub(super) terms: ClosureImagingOptions,
    /// Write each step as one line of JSON to this file.
    #[arg(long, value_name = "FILE")]
    pub(super) log: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}
