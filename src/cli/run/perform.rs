//! Runs one command of a run or of a comparison as if it had been typed.

use super::command::{Done, Step};
use super::place;
use crate::cli::ahead::Ahead;
use crate::cli::console::Console;
use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Result};

/// Run a step in the hidden folder `here`. Its numbers and messages name the final folder `shown`.
///
/// # Errors
/// The step failed. The message begins with its command.
pub(in crate::cli) fn perform(step: Step, here: &str, shown: &str, context: &Context) -> Result<Done> {
    let command = step.shown(shown);
    let started = std::time::Instant::now();
    let (console, subcommands) = (Console::new(context.console.loudness), context.subcommands);
    let inner = Context { command_line: command.clone(), console, subcommands, ahead: Ahead::default() };
    let outcome = (subcommands.run)(&step.argv(here), &inner).map_err(|e| e.renamed(here, shown)).context(&command)?;
    if let Some(why) = outcome.failed {
        context.console.warn(&format!("{}: {why}", step.title));
    }
    let warnings = inner.console.take_warnings().into_iter().map(|w| w.replace(here, shown)).collect();
    Ok(Done { step, command, json: place::renamed(outcome.json, here, shown), warnings, seconds: started.elapsed().as_secs_f64() })
}
