//! `study --slurm`: a job array with one shard a task, and a job that merges them.

use super::args::StudyArgs;
use super::plan::Plan;
use super::shard::Shard;
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::options::{NOTHING, OutputArgs};
use crate::cli::slurm::{Array, Need, Pilot, Script, beside, job_command, quoted, script_of, study};
use crate::study::trial;
use std::path::Path;
use std::time::Instant;

/// Time that one task of the array should take, s.
const TASK_S: f64 = 3600.0;
/// Tasks of an array unless the user gives their number.
const MOST_TASKS: usize = 100;

/// Write DIR.sbatch and DIR-merge.sbatch. `begun` is when the plan was begun.
///
/// # Errors
/// A script that exists, a trial that fails, or an error of the file system.
pub(super) fn write(args: &StudyArgs, (folder, begun): (&Path, Instant), plan: &Plan, context: &Context) -> Result<Outcome> {
    ensure!(args.shard.is_none() && !args.merge, Failure::usage("--slurm: the scripts say --shard and --merge themselves"));
    let cpus = args.slurm.cpus()?;
    let (array, merge) = (beside(folder, ".sbatch"), beside(folder, "-merge.sbatch"));
    let out = OutputArgs { output: array.clone(), overwrite: args.overwrite };
    out.claim([&array, &merge], NOTHING)?;
    let trials = plan.study.n_trials() + plan.failing.as_ref().map_or(0, |f| f.n() * plan.study.seeds.len());
    let pilot = measured(plan, begun, context)?;
    let all_s = pilot.trial_s * trials as f64 / cpus as f64;
    let wanted = args.shards.unwrap_or(((all_s / TASK_S).ceil() as usize).clamp(1, MOST_TASKS));
    let shards = wanted.min(trials);
    format!("1/{wanted}").parse::<Shard>().map_err(|e| Failure::usage(format!("--shards is {wanted}: {e}")))?;
    let need = study(&args.slurm, &pilot, trials.div_ceil(shards));
    let (log, merge_log) = (beside(folder, "-slurm-%A-%a.log"), beside(folder, "-slurm-%j.log"));
    let submit = format!("sbatch --dependency=afterok:$(sbatch --parsable {}) {}", quoted(&array), quoted(&merge));
    let of_array = Script {
        array: Some(Array(shards)),
        submit: submit.clone(),
        ..script_of(&args.slurm, ("study", need), &log, job_command(context, cpus, &format!("--shard $SLURM_ARRAY_TASK_ID/{shards}"))?)
    };
    // The trials of a question depend on all others, so the job that merges runs them.
    let asked = plan.asked.as_ref().map_or(0, |_| trials);
    let of_merge = Script {
        submit: submit.clone(),
        ..script_of(&args.slurm, ("merge", study(&args.slurm, &pilot, asked)), &merge_log, job_command(context, cpus, "--merge")?)
    };
    let texts = [of_array.text()?, of_merge.text()?];
    out.write(&array, texts[0].as_bytes())?;
    out.write(&merge, texts[1].as_bytes())?;
    let Need { seconds, bytes } = need;
    let json = serde_json::json!({
        "output": array, "merge": merge, "shards": shards, "trials": trials, "cpus": cpus, "time_s": seconds, "memory_bytes": bytes,
        "trial_s": pilot.trial_s, "submit": submit,
    });
    let asks = format!("each asks for {:.0} min, {:.2} GB and {cpus} processors", seconds / 60.0, bytes as f64 / 1e9);
    let text = format!(
        "{trials} trials of {:.2} s in {shards} tasks; {asks}\n{} and {}: submit them by\n  {submit}",
        pilot.trial_s,
        array.display(),
        merge.display()
    );
    Ok(Outcome::new(json, text).wrote(array).wrote(merge))
}

/// What the first trial of the first and of the last point take, as each trial runs: on one thread.
pub(super) fn measured(plan: &Plan, begun: Instant, context: &Context) -> Result<Pilot> {
    let (setups, seed) = (&plan.study.setups, plan.study.seeds[0]);
    let mut pilot = Pilot { setup_s: begun.elapsed().as_secs_f64(), before_bytes: Pilot::memory().0, ..Pilot::default() };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    context.console.note("measuring two trials");
    for setup in [setups.first(), setups.last()].into_iter().flatten() {
        let started = Instant::now();
        pool.install(|| trial(setup, seed))?;
        pilot.trial_s = pilot.trial_s.max(started.elapsed().as_secs_f64());
    }
    pilot.peak_bytes = Pilot::memory().1;
    Ok(pilot)
}
