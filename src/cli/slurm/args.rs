//! The options of `--slurm`.

use crate::cli::failure::{Failure, Result, ensure};
use crate::memory::MemoryBudget;
use cittert_arrays::quantity::Duration;
use clap::Args;

/// Options of `--slurm`.
#[derive(Debug, Clone, Args)]
#[command(next_help_heading = "Slurm")]
pub(in crate::cli) struct SlurmArgs {
    /// Write a script for the batch system Slurm (the output with the ending .sbatch) instead of running the command.
    #[arg(long)]
    pub(super) slurm: bool,
    /// Time limit of a job.
    #[arg(long, value_name = "TIME", requires = "slurm")]
    pub(super) slurm_time: Option<Duration>,
    /// Memory of a job, such as 16GB. Half of it is for data and transforms, as --memory says.
    #[arg(long, value_name = "SIZE", requires = "slurm")]
    pub(super) slurm_memory: Option<MemoryBudget>,
    /// Processors of a job. It runs so many threads.
    #[arg(long, value_name = "N", requires = "slurm", default_value_t = 1)]
    pub(super) slurm_cpus: usize,
    /// A line of the script that begins with #SBATCH, such as --partition=long. May be repeated.
    #[arg(long, value_name = "OPTION", requires = "slurm", allow_hyphen_values = true)]
    pub(super) slurm_option: Vec<String>,
}

impl SlurmArgs {
    /// Whether a script is wanted.
    pub(in crate::cli) fn is_wanted(&self) -> bool {
        self.slurm
    }

    /// Processors of a job.
    ///
    /// # Errors
    /// A number that no machine has.
    pub(in crate::cli) fn cpus(&self) -> Result<usize> {
        let n = self.slurm_cpus;
        ensure!((1..=1024).contains(&n), Failure::usage(format!("--slurm-cpus is {n}, expected 1 to 1024")));
        Ok(n)
    }
}
