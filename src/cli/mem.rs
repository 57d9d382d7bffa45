//! `mem`: maximum entropy.

mod closures;

use super::context::{Context, Outcome};
use super::failure::{Failure, Result};
use super::options::{ColumnArgs, ImagingArgs, OutputArgs, TermsArgs};
use cittert_arrays::quantity::FluxDensity;
use clap::Args;
use closures::ClosureRun;
use std::path::PathBuf;

/// Options of `mem`.
#[derive(Debug, Args)]
pub struct MemArgs {
    /// Visibilities.
    #[arg(value_name = "IN")]
    input: PathBuf,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingArgs,
    #[command(flatten)]
    terms: TermsArgs,
    /// Total flux of the image [default: the one that the amplitudes make most likely].
    #[arg(long, value_name = "FLUX")]
    flux: Option<FluxDensity>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Image and write PREFIX-model, -residual, -image .fits.
///
/// # Errors
/// Anything wrong with the file, the options or the disk.
pub fn run(args: &MemArgs, context: &Context) -> Result<Outcome> {
    if !args.terms.asked() {
        return Err(Failure::usage("--terms is needed: cphase, logcamp, amp and vis, with commas between"));
    }
    let MemArgs { input, column, imaging, terms, flux, out } = args;
    closures::run(&ClosureRun { input, column, imaging, terms, flux: flux.map(|f| f.si()), out }, context)
}
