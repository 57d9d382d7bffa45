//! `man`: manual pages of the program and of every subcommand.

use super::context::Outcome;
use super::failure::{Context as _, Result};
use super::options::{NOTHING, OutputArgs};
use cittert_formats::atomic::{AtomicDir, Replaces};
use clap::Args;
use clap_mangen::Man;
use std::path::{Path, PathBuf};

/// The page of the program itself.
const FIRST: &str = "cittert.1";

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
    let json = serde_json::json!({ "output": args.output, "n_pages": pages.len() });
    let outcome = Outcome::new(json, format!("{}: {} manual pages", args.output.display(), pages.len()));
    let outcome = pages.iter().fold(outcome, |o, (name, _)| o.wrote(args.output.join(name)));
    if args.output.exists() {
        add(&args.output, args.overwrite, pages)?;
    } else {
        create(&args.output, &pages)?;
    }
    Ok(outcome)
}

/// Write the pages into a folder that exists. No page is written where one of them would be refused.
fn add(folder: &Path, overwrite: bool, pages: Vec<(String, Vec<u8>)>) -> Result<()> {
    let out = OutputArgs { output: folder.to_owned(), overwrite };
    let pages: Vec<(PathBuf, Vec<u8>)> = pages.into_iter().map(|(name, text)| (folder.join(name), text)).collect();
    out.claim(pages.iter().map(|(path, _)| path), NOTHING)?;
    pages.iter().try_for_each(|(path, text)| out.write(path, text))
}

/// Write the pages into a new folder, which appears when all of them are there.
fn create(folder: &Path, pages: &[(String, Vec<u8>)]) -> Result<()> {
    if let Some(parent) = folder.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).context(parent.display())?;
    }
    let new = AtomicDir::create(folder, false, Replaces::Holding(FIRST))?;
    for (name, text) in pages {
        std::fs::write(new.path().join(name), text).context(folder.join(name).display())?;
    }
    Ok(new.commit()?)
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
