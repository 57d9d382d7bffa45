//! `man`: manual pages of the program and of every subcommand.

use super::context::Outcome;
use super::failure::{Context as _, Result};
use super::options::{NOTHING, OutputArgs};
use clap::Args;
use clap_mangen::Man;
use std::path::PathBuf;

/// Options of `man`.
#[derive(Debug, Args)]
pub struct ManArgs {
    /// Folder for the manual pages; it is created where it is missing.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace manual pages that exist.
    #[arg(long)]
    overwrite: bool,
}

/// Write one page for the program, one for each subcommand and one for each nested subcommand.
///
/// # Errors
/// A page that exists already, a folder that cannot be written.
pub fn run(args: &ManArgs, program: clap::Command) -> Result<Outcome> {
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut pages = Vec::new();
    collect(program, &mut pages)?;
    std::fs::create_dir_all(&args.output).context(args.output.display())?;
    let out = OutputArgs { output: args.output.clone(), overwrite: args.overwrite };
    let pages: Vec<(PathBuf, Vec<u8>)> = pages.into_iter().map(|(name, text)| (args.output.join(name), text)).collect();
    // No page is written where one of them would be refused.
    out.claim(pages.iter().map(|(path, _)| path), NOTHING)?;
    let json = serde_json::json!({ "output": args.output, "n_pages": pages.len() });
    let mut outcome = Outcome::new(json, format!("{}: {} manual pages", args.output.display(), pages.len()));
    for (path, text) in pages {
        out.write(&path, &text)?;
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

/// File names and texts of the pages of a command and of the commands below it.
fn collect(command: clap::Command, pages: &mut Vec<(String, Vec<u8>)>) -> Result<()> {
    for below in command.get_subcommands().filter(|c| !c.is_hide_set()) {
        collect(below.clone(), pages)?;
    }
    let page = Man::new(command).source(concat!("cittert ", env!("CARGO_PKG_VERSION")));
    let mut text = Vec::new();
    page.render(&mut text)?;
    pages.push((page.get_filename(), text));
    Ok(())
}
