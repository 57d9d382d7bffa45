//! `run`: the whole chain from one file.
//!
//! Each section of the file becomes the words of a subcommand. The subcommand then runs as if it had been typed, and the report shows its words.

mod calibration;
pub(super) mod command;
mod config;
mod forecast;
pub(super) mod labels;
mod page;
pub(super) mod perform;
pub(super) mod place;
mod steps;
mod verdict;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{ConfigArgs, OutputArgs};
use super::quality;
use super::sections::schema;
use super::slurm::{SlurmArgs, one_job};
use cittert_formats::atomic::{AtomicDir, Replaces};
use clap::Args;
use command::{Done, Step};
use config::Config;
use perform::perform;
use serde_json::{Value, json};
use std::ffi::OsString;
use std::path::Path;
use steps::steps;

/// The name in the list of files that a run leaves in its folder.
const WRITER: &str = "cittert run";
/// Files of a run beside those of its steps.
const OWN: [&str; 2] = ["metrics.json", "report.html"];

/// Options of `run`.
#[derive(Debug, Args)]
pub struct RunArgs {
    #[command(flatten)]
    of: ConfigArgs,
    /// Replace a folder of an earlier run.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    slurm: SlurmArgs,
}

/// Run a configuration.
///
/// # Errors
/// The configuration is wrong (the message names the line), or a step failed. The output then does not exist. Where only the quality that
/// the configuration states is missed, the output is complete, and the outcome has failed.
pub fn run(args: &RunArgs, context: &Context) -> Result<Outcome> {
    if args.of.schema {
        return schema::<Config>();
    }
    let (path, text) = args.of.read()?;
    let (config, steps) = check(&text, path)?;
    let Some(target) = args.of.folder() else {
        let lines = commands(&steps, context.subcommands.check)?;
        return Ok(Outcome::new(json!({ "commands": lines }), lines.join("\n")));
    };
    let out = OutputArgs { output: target.to_path_buf(), overwrite: args.overwrite };
    if args.slurm.is_wanted() {
        commands(&steps, context.subcommands.check)?;
        return one_job(&args.slurm, ("run", None), &out, context);
    }
    out.claim([target], place::inputs(path, &steps))?;
    let folder = AtomicDir::create(target, args.overwrite, Replaces::FilesOf(WRITER))?;
    place::refuse_taken(target, WRITER, &steps, &OWN.map(str::to_owned))?;
    let (here, shown) = (folder.path().display().to_string(), target.display().to_string());
    let mut done = Vec::new();
    let total = steps.len();
    for (i, step) in steps.into_iter().enumerate() {
        context.console.note(&format!("[{}/{total}] {}", i + 1, step.title));
        done.push(perform(step, &here, &shown, context)?);
    }
    let mut metrics = metrics(&config, &done, context);
    let verdict = quality::judge(&config.quality, &metrics);
    metrics["quality"] = verdict.json;
    std::fs::write(folder.path().join("metrics.json"), serde_json::to_vec_pretty(&metrics)?)?;
    let page = page::page(&config, path, &done, folder.path(), context)?;
    std::fs::write(folder.path().join("report.html"), page)?;
    folder.commit()?;
    let report = target.join("report.html");
    let text = [page::summary(&done), verdict.text, report.display().to_string()];
    let text = text.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join("\n");
    Ok(Outcome { failed: verdict.failed, ..Outcome::new(metrics, text).wrote(report) })
}

fn check(text: &str, path: &Path) -> Result<(Config, Vec<Step>)> {
    let config: Config = crate::cli::numbers::read(text, path)?;
    let steps = steps(&config, path.parent().unwrap_or(Path::new(""))).context(path.display())?;
    check_quality(&config, &steps).context(format!("{}", path.display()))?;
    Ok((config, steps))
}

/// Every number of the quality must be a result of a step.
fn check_quality(config: &Config, steps: &[Step]) -> Result<()> {
    quality::check(&config.quality).map_err(Failure::message)?;
    let known: Vec<&str> = steps.iter().map(|s| s.key.as_str()).filter(|k| !k.is_empty()).collect();
    for path in config.quality.keys() {
        let is_of = |key: &&str| path.strip_prefix(*key).is_some_and(|rest| rest.starts_with('.'));
        if !known.iter().any(is_of) {
            let expected = known.join(", ");
            return Err(Failure::message(format!("quality: {path:?} is no result of this run, expected a number of one of {expected}")));
        }
    }
    Ok(())
}

fn commands(steps: &[Step], check: fn(&[OsString]) -> Result<()>) -> Result<Vec<String>> {
    for step in steps {
        check(&step.argv("OUT")).context(step.shown("OUT"))?;
    }
    Ok(steps.iter().map(|s| s.shown("OUT")).collect())
}

/// The commands of a configuration. `path` is the file from which its text was read: messages name it, and paths are relative to it.
/// `check_words` checks the words of one command.
///
/// # Errors
/// The configuration is wrong. The message names the line.
pub fn run_commands(text: &str, path: &Path, check_words: fn(&[OsString]) -> Result<()>) -> Result<Vec<String>> {
    commands(&check(text, path)?.1, check_words)
}

fn metrics(config: &Config, done: &[Done], context: &Context) -> Value {
    let mut all = json!({
        "title": config.title, "seed": config.seed, "version": env!("CARGO_PKG_VERSION"), "command": context.command_line,
        "seconds": done.iter().map(|d| (d.step.title.clone(), d.seconds.into())).collect::<serde_json::Map<_, _>>(),
    });
    for d in done.iter().filter(|d| !d.step.key.is_empty()) {
        match d.step.key.split_once('.') {
            // `clean.hogbom` is the entry `hogbom` of the object `clean`.
            Some((group, name)) => all[group][name] = d.json.clone(),
            None => all[&d.step.key] = d.json.clone(),
        }
    }
    all
}
