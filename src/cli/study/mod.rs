//! `study`: Monte-Carlo over seeds and over any parameter of a configuration.
//!
//! From the start, the output folder contains a journal of the finished trials. A study that was killed therefore continues where it
//! stopped. Tables, pictures and the page are written when all trials are finished.
//!
//! Under `mpirun`, processes share the trials. Process 0 alone has the journal and writes; the others give it their results.

mod answers;
mod args;
mod axes;
mod config;
mod failing;
mod failures;
mod forecast;
mod journal;
mod merge;
mod output;
mod pictures;
mod plan;
mod question;
mod sentence;
mod setups;
mod shard;
mod slurm;
mod tables;
mod trials;

pub use args::StudyArgs;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::options::keep_apart;
use super::ranks;
use super::sections::schema;
use crate::study::Study;
use journal::{Journal, Key};
use std::path::Path;
use trials::{Job, Trials};

/// Run a study, or its remaining trials.
///
/// # Errors
/// The configuration is wrong, the folder holds other files, a trial fails, or an error of the file system.
pub fn run(args: &StudyArgs, context: &Context) -> Result<Outcome> {
    if args.of.schema {
        return schema::<config::Config>();
    }
    let started = std::time::Instant::now();
    let (path, text) = args.of.read()?;
    let mut plan = plan::Plan::new(&text, path, context).context(format!("{}", path.display()))?;
    let (points, seeds, planned) = (plan.study.setups.len(), plan.study.seeds.len(), plan.study.n_trials());
    let failures = plan.failing.as_ref().map_or(0, |f| f.n() * seeds);
    let Some(folder) = args.of.folder() else {
        let mut text = format!("{points} points x {seeds} seeds = {planned} trials");
        if failures > 0 {
            text += &format!(", and {failures} without an antenna");
        }
        if plan.asked.is_some() {
            text += ", and those that the question needs";
        }
        let json = serde_json::json!({ "points": points, "seeds": seeds, "trials": planned, "failures": failures });
        return Ok(Outcome::new(json, text));
    };
    let inputs: Vec<&Path> = std::iter::once(path).chain(plan.setups.inputs()).collect();
    keep_apart(&[folder], &inputs)?;
    if args.slurm.is_wanted() {
        ranks::refuse_several("--slurm writes scripts and runs two trials only. Start it without mpirun")?;
        return slurm::write(args, (folder, started), &plan, context);
    }
    let place = args.shard.map_or_else(|| folder.to_owned(), |shard| shard.folder(folder));
    // The other processes only run trials.
    let opened = (!ranks::is_silent()).then(|| Journal::open(&place, &plan.fingerprint, planned, args.overwrite, context)).transpose()?;
    let mut all = Trials::new(opened, args.shard, ranks::all(), &context.console);
    if args.merge && !ranks::is_silent() {
        let jobs = [(0..planned).map(Key::Grid).collect(), failures::keys(&plan)];
        merge::merge(folder, &plan.fingerprint, planned, &jobs, &mut all)?;
    }
    let resumed = all.resumed;
    if resumed > 0 {
        context.console.note(&format!("{resumed} trials are in the journal already"));
    }
    let started = std::time::Instant::now();
    grid(&plan.study, &mut all).context(path.display())?;
    failures::fail(&plan, &mut all).context(path.display())?;
    if let Some(shard) = args.shard {
        let n = all.done.len();
        let json =
            serde_json::json!({ "shard": shard.to_string(), "trials": n, "resumed": resumed, "seconds": started.elapsed().as_secs_f64() });
        let text = format!("shard {shard}: {n} trials ({resumed} from the journal); when all shards are done: --merge");
        return Ok(Outcome::new(json, text));
    }
    let answers = answers::answer(&mut plan, &mut all, context).context(path.display())?;
    if ranks::is_silent() {
        return Ok(Outcome::new(serde_json::Value::Null, ""));
    }
    let seconds = started.elapsed().as_secs_f64();
    let found = output::write(folder, &plan, &all, &answers, path, context)?;
    let trials = all.done.len();
    let failed = all.done.values().filter(|r| r.accepted.is_some() && r.after.is_none()).count();
    let report = folder.join("report.html");
    let mut json = found.metrics;
    for (key, value) in [("resumed", resumed), ("failed", failed)] {
        json[key] = value.into();
    }
    json["seconds"] = seconds.into();
    json["trials_per_s"] = ((trials - resumed) as f64 / seconds.max(1e-9)).into();
    let counts = format!("{trials} trials ({resumed} from the journal, {failed} could not be calibrated)");
    let report_line = report.display().to_string();
    let lines = found.sentences.iter().chain([&found.verdict.text, &counts, &report_line]).filter(|l| !l.is_empty());
    let text = lines.cloned().collect::<Vec<_>>().join("\n");
    Ok(Outcome { failed: found.verdict.failed, ..Outcome::new(json, text).wrote(report) })
}

/// Run the trials of the grid.
fn grid(study: &Study, all: &mut Trials<'_>) -> Result<()> {
    let job = |k: usize| {
        let (point, seed) = study.place(k);
        Job { key: Key::Grid(k), setup: &study.setups[point], seed }
    };
    let jobs: Vec<Job<'_>> = (0..study.n_trials()).map(job).collect();
    let place = |key: &Key| if let Key::Grid(k) = key { study.grid.place(study.place(*k).0) } else { String::new() };
    all.run(&jobs, &place)
}
