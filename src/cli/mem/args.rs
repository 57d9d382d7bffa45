//! The options of `mem`.

use crate::cli::failure::Result;
use crate::cli::held_out::HoldOutArgs;
use crate::cli::options::{ColumnArgs, OutputArgs, prior_file};
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
    #[command(flatten)]
    pub(super) hold_out: HoldOutArgs,
    /// Write each step as one line of JSON to this file.
    #[arg(long, value_name = "FILE")]
    pub(super) log: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

impl MemCommandArgs {
    /// Claim the outputs of the command, and its log.
    ///
    /// # Errors
    /// As [`OutputArgs::claim`].
    pub(super) fn claim(&self, outputs: Vec<PathBuf>) -> Result<()> {
        self.out.claim(outputs.iter().chain(&self.log), [&self.input].into_iter().chain(self.given()))
    }

    /// The images that are given beside the data: the mask and the prior.
    pub(super) fn given(&self) -> impl Iterator<Item = &PathBuf> {
        self.mem.mask.iter().chain(self.mem.prior.as_ref().and_then(prior_file))
    }
}
