//! `completions`: the script with which a shell completes commands and options.

use super::context::Outcome;
use super::failure::{Failure, Result};
use clap::Args;
use clap_complete::{Shell, generate};

/// Options of `completions`.
#[derive(Debug, Args)]
pub struct CompletionsArgs {
    /// Shell for which the script is written.
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

/// Print the completion script of a shell.
///
/// # Errors
/// None in practice: the script is text.
pub fn run(args: &CompletionsArgs, mut program: clap::Command) -> Result<Outcome> {
    let mut script = Vec::new();
    generate(args.shell, &mut program, "cittert", &mut script);
    let script = String::from_utf8(script).map_err(|e| Failure::message(format!("the completion script is not text: {e}")))?;
    Ok(Outcome::new(serde_json::json!({ "shell": args.shell.to_string(), "script": script }), script))
}
