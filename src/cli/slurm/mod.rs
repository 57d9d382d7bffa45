//! `--slurm`: writes the script that runs a command on a cluster, instead of running it.
//!
//! | file | what it does |
//! |---|---|
//! | `args` | the options |
//! | `need` | the time and memory that a job asks for: the one place to change when a better model of the cost is there |
//! | `script` | the text of a script |

mod args;
mod need;
mod script;

pub(super) use args::SlurmArgs;
pub(super) use need::{Need, Pilot, study};
pub(super) use script::{Array, Script, quoted};

use super::context::{Context, Outcome};
use super::failure::Result;
use super::forecast::{self, Plan};
use super::options::{NOTHING, OutputArgs};
use crate::memory::MemoryBudget;
use need::stated;
use std::path::{Path, PathBuf};

/// A script with the options of the user.
pub(super) fn script_of<'a>(args: &'a SlurmArgs, (name, need): (&'a str, Need), log: &'a Path, command: String) -> Script<'a> {
    Script { name, need, cpus: args.slurm_cpus, options: &args.slurm_option, log, command, array: None, submit: String::new() }
}

/// Write the script of a command that is one job, beside its output. The command checks its other options when it runs.
///
/// # Errors
/// No time or memory is stated or forecast, the script exists, or an error of the file system.
pub(super) fn one_job(args: &SlurmArgs, (name, plan): (&str, Option<&dyn Plan>), out: &OutputArgs, context: &Context) -> Result<Outcome> {
    let cpus = args.cpus()?;
    let is_told = args.slurm_time.is_some() && args.slurm_memory.is_some();
    let predicted = plan.filter(|_| !is_told).map(|plan| forecast::need(plan, context, cpus)).transpose()?;
    let need = stated(args, name, predicted)?;
    let (path, log) = (beside(&out.output, ".sbatch"), beside(&out.output, "-slurm-%j.log"));
    let scripts = OutputArgs { output: path.clone(), overwrite: out.overwrite };
    scripts.claim([&path], NOTHING)?;
    // A forecast counts with the budget of this machine, and memory that is stated is shared with the system.
    let budget = if args.slurm_memory.is_some() { need.bytes / 2 } else { MemoryBudget::default().bytes() as u64 };
    let command = script::command(&context.command_line, cpus, Some(budget))?;
    let job = Script { submit: format!("sbatch {}", script::quoted(&path)), ..script_of(args, (name, need), &log, command) };
    scripts.write(&path, job.text()?.as_bytes())?;
    let json = serde_json::json!({ "output": path, "time_s": need.seconds, "memory_bytes": need.bytes, "cpus": args.slurm_cpus });
    let text = format!("{}: submit it by\n  {}", path.display(), job.submit);
    Ok(Outcome::new(json, text).wrote(path))
}

/// The path PREFIX + suffix, without a slash at the end of the prefix.
pub(super) fn beside(prefix: &Path, suffix: &str) -> PathBuf {
    let mut name = prefix.components().as_path().as_os_str().to_owned();
    name.push(suffix);
    PathBuf::from(name)
}

/// The present command line as a job has it, with more words. The job resumes what an earlier one began, so that `--overwrite` is for the scripts.
///
/// # Errors
/// The program has no path.
pub(super) fn job_command(context: &Context, cpus: usize, more: &str) -> Result<String> {
    Ok(format!("{} {more}", script::command(&context.command_line, cpus, None)?.replace(" --overwrite", "")))
}
