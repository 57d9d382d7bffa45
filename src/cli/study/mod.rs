//! `study`: Monte-Carlo over seeds and over any parameter of a configuration.
//!
//! From the start, the output folder contains a journal of the finished trials. A study that was killed therefore continues where it
//! stopped. Tables, pictures and the page are written when all trials are finished.

mod config;
mod journal;
mod output;
mod plan;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::sections::schema;
use crate::study;
use clap::Args;
use journal::Journal;
use std::path::PathBuf;

/// Options of `study`.
#[derive(Debug, Args)]
pub struct StudyArgs {
    /// The study, as TOML.
    #[arg(value_name = "CONFIG.toml", required_unless_present = "schema")]
    config: Option<PathBuf>,
    /// Folder of the results. An unfinished study of the same configuration in it is continued.
    #[arg(short, long, value_name = "DIR", required_unless_present_any = ["schema", "check"])]
    output: Option<PathBuf>,
    /// Replace another study in that folder, or start this one again.
    #[arg(long)]
    overwrite: bool,
    /// Print the JSON schema of the configuration and stop.
    #[arg(long)]
    schema: bool,
    /// Check the configuration, count its trials, and stop.
    #[arg(long)]
    check: bool,
}

/// Run a study, or its remaining trials.
///
/// # Errors
/// The configuration is wrong, the folder holds other files, a trial fails, or an error of the file system.
pub fn run(args: &StudyArgs, context: &Context) -> Result<Outcome> {
    if args.schema {
        return schema::<config::Config>();
    }
    let Some(path) = &args.config else { return Err(Failure::usage("give a configuration file")) };
    let text = cittert_formats::read_text(path)?;
    let plan = plan::Plan::new(&text, path, context).context(format!("{}", path.display()))?;
    let study = &plan.study;
    let (points, seeds, trials) = (study.setups.len(), study.seeds.len(), study.n_trials());
    let Some(folder) = args.output.as_ref().filter(|_| !args.check) else {
        let json = serde_json::json!({ "points": points, "seeds": seeds, "trials": trials });
        return Ok(Outcome::new(json, format!("{points} points x {seeds} seeds = {trials} trials")));
    };
    let (mut journal, mut done) = Journal::open(folder, &plan.fingerprint, trials, args.overwrite, context)?;
    let resumed = done.len();
    if resumed > 0 {
        context.console.note(&format!("{resumed} of {trials} trials are in the journal already"));
    }
    let started = std::time::Instant::now();
    let finished = done.keys().copied().collect();
    let store = &mut |index: usize, result: study::TrialResult| {
        journal.append(index, &result).map_err(|e| crate::ChainError::Other(e.to_string().into()))?;
        done.insert(index, result);
        Ok(())
    };
    study::run(study, &finished, rayon::current_num_threads(), store, &context.console)?;
    let seconds = started.elapsed().as_secs_f64();
    let summary = output::write(folder, &plan, &done, path, context)?;
    let failed = done.values().filter(|r| plan.study.setups.iter().any(|s| s.selfcal.is_some()) && r.after.is_none()).count();
    let report = folder.join("report.html");
    let json = serde_json::json!({
        "points": points, "seeds": seeds, "trials": trials, "resumed": resumed, "failed": failed,
        "trials_per_s": (trials - resumed) as f64 / seconds.max(1e-9), "seconds": seconds, "summary": summary,
    });
    let text = format!("{trials} trials ({resumed} from the journal, {failed} could not be calibrated)\n{}", report.display());
    Ok(Outcome::new(json, text).wrote(report))
}
