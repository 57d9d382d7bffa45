//! The command line: parse, load, call one function of the chain, save.
//!
//! A subcommand is an args struct and `run(args, context)`. Only this module prints, and only it joins the chain with
//! the formats and the scene simulator.

mod applycal;
mod beam;
mod beside;
mod clean;
mod closure;
mod compare;
mod console;
mod context;
mod convert;
mod corrupt;
mod dirty;
mod failure;
mod grid;
mod identify;
mod info;
mod kind;
mod layout;
mod mask;
mod mem;
mod options;
mod picture;
mod plot;
mod predict;
mod run;
mod scene;
mod selfcal;
mod simulate;
mod study;
mod text;

pub use failure::{Failure, Result};
pub use run::run_commands;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use console::{Console, Loudness};
use context::{Context, Outcome, shell_word};
use std::ffi::OsString;
use std::io::Write;

/// Aperture synthesis for people who design sparse antenna arrays and test calibrations.
#[derive(Debug, Parser)]
#[command(name = "cittert", version, propagate_version = true, max_term_width = 110)]
struct Cli {
    /// Tell each phase and its time on stderr.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
    /// Tell nothing but errors on stderr.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Number of threads (default: one for each processor).
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
    /// Memory that the data and the transforms may take, such as 4GB [default: half of what the machine has].
    #[arg(long, global = true, value_name = "SIZE")]
    memory: Option<crate::memory::MemoryBudget>,
    /// Print the results as one JSON object, in SI units.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

/// The subcommands: one row each here, one file each beside this one.
#[derive(Debug, Subcommand)]
enum Command {
    /// The whole chain from one file, with a report.
    Run(run::RunArgs),
    /// Built-in antenna layouts and layout files.
    #[command(subcommand)]
    Layout(layout::LayoutCommand),
    /// The u-v mask of a layout on the FFT grid.
    Mask(mask::MaskArgs),
    /// Brightness scenes.
    #[command(subcommand)]
    Scene(scene::SceneCommand),
    /// Visibilities of a scene seen by an array.
    Simulate(simulate::SimulateArgs),
    /// Put known antenna errors into data and keep the truth.
    Corrupt(corrupt::CorruptArgs),
    /// Gridded visibilities.
    Grid(grid::GridArgs),
    /// The dirty beam (point spread function).
    Beam(beam::BeamArgs),
    /// The dirty image.
    Dirty(dirty::DirtyArgs),
    /// Deconvolve by CLEAN.
    Clean(clean::CleanCommandArgs),
    /// Image by maximum entropy, with a certificate.
    Mem(Box<mem::MemCommandArgs>),
    /// Rounds of imaging and solving for antenna gains.
    Selfcal(Box<selfcal::SelfcalArgs>),
    /// Apply a gain table.
    Applycal(applycal::ApplycalArgs),
    /// Closure phases and amplitudes.
    Closure(closure::ClosureArgs),
    /// What a calibration of an array can know.
    Identify(identify::IdentifyArgs),
    /// Visibilities of a model on the rows of a set, or the residual.
    Predict(predict::PredictArgs),
    /// Monte-Carlo: what errors cost an image, and what self-calibration brings back.
    Study(study::StudyArgs),
    /// What is in a file.
    Info(info::InfoArgs),
    /// A picture of any file.
    Plot(plot::PlotArgs),
    /// How far an image or a gain table is from the truth.
    Compare(compare::CompareArgs),
    /// From one format to another.
    Convert(convert::ConvertArgs),
}

impl Command {
    fn run(&self, context: &Context) -> Result<Outcome> {
        match self {
            Self::Run(a) => run::run(a, context),
            Self::Layout(a) => layout::run(a, context),
            Self::Mask(a) => mask::run(a, context),
            Self::Scene(a) => scene::run(a, context),
            Self::Simulate(a) => simulate::run(a, context),
            Self::Corrupt(a) => corrupt::run(a, context),
            Self::Grid(a) => grid::run(a, context),
            Self::Beam(a) => beam::run(a, context),
            Self::Dirty(a) => dirty::run(a, context),
            Self::Clean(a) => clean::run(a, context),
            Self::Mem(a) => mem::run(a, context),
            Self::Selfcal(a) => selfcal::run(a, context),
            Self::Applycal(a) => applycal::run(a, context),
            Self::Closure(a) => closure::run(a, context),
            Self::Identify(a) => identify::run(a, context),
            Self::Predict(a) => predict::run(a, context),
            Self::Study(a) => study::run(a, context),
            Self::Info(a) => info::run(a, context),
            Self::Plot(a) => plot::run(a, context),
            Self::Compare(a) => compare::run(a, context),
            Self::Convert(a) => convert::run(a, context),
        }
    }
}

/// The parser, for completions, manual pages and the book.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

/// Run the words of a command line (the first is the program's name) and print the result.
///
/// # Errors
/// The failure to print and its exit code.
pub fn run(words: impl IntoIterator<Item = OsString>) -> Result<()> {
    let words: Vec<OsString> = words.into_iter().collect();
    let command_line = words
        .iter()
        .enumerate()
        .map(|(i, w)| if i == 0 { "cittert".to_owned() } else { shell_word(&w.to_string_lossy()) })
        .collect::<Vec<_>>()
        .join(" ");
    let cli = parse(&words)?;
    let loudness = match (cli.quiet, cli.verbose) {
        (true, _) => Loudness::Quiet,
        (_, true) => Loudness::Verbose,
        _ => Loudness::Normal,
    };
    if let Some(threads) = cli.threads {
        if threads == 0 || threads > 1024 {
            return Err(Failure::usage(format!("--threads is {threads}, expected 1 to 1024")));
        }
        // Fails only when a pool exists already, as in tests that call this twice.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(threads).build_global();
    }
    if let Some(memory) = cli.memory {
        memory.set();
    }
    let context = Context { command_line, console: Console::new(loudness) };
    let outcome = guarded(|| cli.command.run(&context))?;
    let text = if cli.json { outcome.json.to_string() } else { outcome.text.trim_end().to_owned() };
    if !text.is_empty() {
        // A reader that went away (`| head`) is no error.
        let _ = writeln!(std::io::stdout(), "{text}");
    }
    match outcome.failed {
        Some(why) => Err(Failure::message(why)),
        None => Ok(()),
    }
}

fn parse(words: &[OsString]) -> Result<Cli> {
    let matches = Cli::command().try_get_matches_from(words)?;
    Ok(Cli::from_arg_matches(&matches)?)
}

/// A panic is a fault of ours; the user gets one sentence, not a stack.
fn guarded<T>(work: impl FnOnce() -> Result<T>) -> Result<T> {
    let seen = std::sync::Arc::new(std::sync::Mutex::new(String::new()));
    let sink = seen.clone();
    let before = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if let Ok(mut s) = sink.lock() {
            *s = info.to_string();
        }
    }));
    let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
    std::panic::set_hook(before);
    result.unwrap_or_else(|_| {
        let what = seen.lock().map(|s| s.clone()).unwrap_or_default();
        Err(Failure::message(format!("internal error, please report it with the command line: {}", what.replace('\n', " "))))
    })
}
