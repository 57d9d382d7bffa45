//! The options of `study`.

use super::shard::Shard;
use crate::cli::options::ConfigArgs;
use crate::cli::slurm::SlurmArgs;
use clap::Args;

/// Options of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    #[command(flatten)]
    pub(super) of: ConfigArgs,
    /// Replace another study in that folder, or start this one again.
    #[arg(long)]
    pub(super) overwrite: bool,
    /// Run only a part of the trials, such as 3/8: the third of eight parts. All parts have the same DIR, and run in any order, on any machines.
    #[arg(long, value_name = "I/N", conflicts_with = "merge")]
    pub(super) shard: Option<Shard>,
    /// Put the trials of all shards together, and write the results.
    #[arg(long)]
    pub(super) merge: bool,
    #[command(flatten)]
    pub(super) slurm: SlurmArgs,
    /// Number of shards of --slurm [default: one for about an hour of trials, at most 100].
    #[arg(long, value_name = "N", requires = "slurm", help_heading = "Slurm")]
    pub(super) shards: Option<usize>,
}
