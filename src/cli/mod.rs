//! The command line: parse, load, call one function of the chain, save.
//!
//! A subcommand is an args struct and `run(args, context)`. Only this module prints, and only it joins the chain with
//! the formats and the scene simulator.

mod ahead;
mod airs;
mod applycal;
mod beam;
mod beside;
mod clean;
mod closure;
mod compare;
mod compare_pointings;
mod completions;
mod console;
mod context;
mod convert;
mod corrupt;
mod cycle_log;
mod design;
mod dirty;
mod enhance;
mod failure;
mod film;
mod focus;
mod forecast;
mod grid;
mod held_out;
mod identify;
mod info;
mod interrupt;
mod layout;
mod made;
mod man;
mod mask;
mod mem;
mod memory_nodes;
mod numbers;
mod optimize;
mod options;
mod picture;
mod planned;
mod plot;
mod predict;
mod quality;
mod ranks;
mod run;
mod scene;
mod scene_errors;
mod sections;
mod selfcal;
mod sensor;
mod simulate;
mod slurm;
mod study;
mod text;
mod verdict;
mod zero_spacing;

pub use failure::{Failure, Result};
pub use memory_nodes::spread_memory;
pub use ranks::{end, fail};

use crate::ensure;
use ahead::Ahead;
use cittert_formats::atomic::{Together, on_the_pool, take_notes};
use clap::{CommandFactory, FromArgMatches, Parser};
use console::{Console, Loudness};
use context::{Context, Outcome, Subcommands, shell_word, subcommands};
use failure::Context as _;
use forecast::{ForecastArgs, Plan, Planner, Told};
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

/// Aperture synthesis: design sparse antenna arrays, simulate visibilities, inject errors, image and self-calibrate.
#[derive(Debug, Parser)]
#[command(name = "cittert", version, propagate_version = true, max_term_width = 110)]
struct Cli {
    /// Print each phase of the work and its time on stderr.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
    /// Print only errors on stderr.
    #[arg(short, long, global = true)]
    quiet: bool,
    /// Number of threads [default: one for each processor].
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
    /// Memory that the data and the transforms may take, such as 4GB [default: half of what the machine has].
    #[arg(long, global = true, value_name = "SIZE")]
    memory: Option<crate::memory::MemoryBudget>,
    /// Print the results as one JSON object, in SI units.
    #[arg(long, global = true)]
    json: bool,
    #[command(flatten)]
    forecast: ForecastArgs,
    #[command(subcommand)]
    command: Command,
}

subcommands! {
    /// The subcommands. Each is one row here and one file beside this one.
    Command {
        /// Run the whole chain from one configuration file, with pictures, numbers and a report.
        Run(run::RunArgs) => run::run;
        /// List, generate, describe and convert antenna layouts.
        #[command(subcommand)]
        Layout(layout::LayoutCommand) => |command: &layout::LayoutCommand, context| command.run(context);
        /// Write the u-v mask of a layout on the FFT grid, with coverage figures.
        Mask(mask::MaskArgs) => mask::run;
        /// Render scenes, and print the physics behind them as tables.
        #[command(subcommand)]
        Scene(scene::SceneCommand) => |command: &scene::SceneCommand, context| command.run(context);
        /// Simulate the visibilities that an array measures of a scene.
        Simulate(simulate::SimulateArgs) => simulate::run;
        /// Phase visibilities to a point near the array, and say where a Fourier image of them is valid.
        Focus(focus::FocusArgs) => focus::run;
        /// Put known antenna errors into visibilities, and keep the true gains.
        Corrupt(corrupt::CorruptArgs) => corrupt::run;
        /// Write the gridded visibilities.
        Grid(grid::GridArgs) => grid::run;
        /// Write the dirty beam (point spread function).
        Beam(beam::BeamArgs) => beam::run;
        /// Write the dirty image.
        Dirty(dirty::DirtyArgs) => dirty::run;
        /// Deconvolve by CLEAN: Högbom, Clark or multiscale.
        Clean(clean::CleanCommandArgs) => clean::run;
        /// Image by maximum entropy, with a certificate of convergence.
        Mem(Box<mem::MemCommandArgs>) => mem::run;
        /// Self-calibrate: image and solve for antenna gains in turn, or both at once.
        Selfcal(Box<selfcal::SelfcalArgs>) => selfcal::run;
        /// Apply a gain table to visibilities, or put its errors back.
        Applycal(applycal::ApplycalArgs) => applycal::run;
        /// Form closure phases and closure amplitudes.
        Closure(closure::ClosureArgs) => closure::run;
        /// Count what a calibration of an array can determine.
        Identify(identify::IdentifyArgs) => identify::run;
        /// Predict the visibilities of a model, or subtract them from the data.
        Predict(predict::PredictArgs) => predict::run;
        /// Measure by Monte Carlo what errors cost an image and what self-calibration recovers.
        Study(study::StudyArgs) => study::run;
        /// Describe the contents of a file.
        Info(info::InfoArgs) => info::run;
        /// Draw a picture of an image, a visibility set, a gain table or a layout.
        Plot(plot::PlotArgs) => plot::run;
        /// Measure how far an image or a gain table is from the truth.
        Compare(compare::CompareArgs) => compare::run;
        /// See a scene through a filled-aperture sensor: optics, detectors, scan and noise.
        Sensor(Box<sensor::SensorArgs>) => sensor::run;
        /// Enhance an image: less noise, more pixels, more contrast, sharper edges, deconvolution.
        Enhance(enhance::EnhanceArgs) => enhance::run;
        /// Make a film of what a camera with noise sees on its way through a scene, or find its best frame rate.
        Film(Box<film::FilmArgs>) => film::run;
        /// Design an array in the browser: see its beam and its images while you move its antennas.
        Design(design::DesignArgs) => design::run;
        /// Convert a file from one format to another.
        Convert(convert::ConvertArgs) => convert::run;
        /// Print the completion script of a shell.
        Completions(completions::CompletionsArgs) => |args, _| completions::run(args, command());
        /// Write the manual pages.
        Man(man::ManArgs) => |args, _| man::run(args, command());
    }
}

impl Command {
    /// Whether several processes can share the work.
    fn shares_work(&self) -> bool {
        use Command::{Clean, Convert, Dirty, Mem, Predict, Selfcal, Simulate, Study};
        matches!(self, Dirty(_) | Clean(_) | Mem(_) | Selfcal(_) | Simulate(_) | Predict(_) | Convert(_) | Study(_))
    }

    /// Whether the subcommand makes images from visibilities.
    fn images(&self) -> bool {
        use Command::{Beam, Clean, Dirty, Grid, Mem, Selfcal};
        matches!(self, Grid(_) | Beam(_) | Dirty(_) | Clean(_) | Mem(_) | Selfcal(_))
    }

    /// Do the work of the subcommand, or a forecast of it, on the threads that suit it. A loop that begins outside of the pool wakes one of its threads and waits
    /// for it, and imaging has thousands of short loops.
    fn on_its_threads<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        if self.images() { on_the_pool(work) } else { work() }
    }

    /// Run the subcommand on these threads.
    fn perform(&self, context: &Context) -> Result<Outcome> {
        self.on_its_threads(|| self.run(context))
    }

    /// The subcommand as one whose time and memory are known before.
    fn plan(&self) -> Option<&dyn Plan> {
        Some(match self {
            Self::Simulate(args) => args,
            Self::Grid(args) => args,
            Self::Beam(args) => args,
            Self::Dirty(args) => args,
            Self::Clean(args) => args,
            Self::Mem(args) => args.as_ref(),
            Self::Predict(args) => args,
            Self::Selfcal(args) => args.as_ref(),
            Self::Applycal(args) => args,
            Self::Corrupt(args) => args,
            Self::Convert(args) => args,
            Self::Study(args) => args,
            Self::Run(args) => args,
            Self::Scene(args) => return args.plan(),
            Self::Film(args) => args.as_ref(),
            Self::Focus(args) => args,
            Self::Closure(args) => args,
            Self::Mask(args) => args,
            Self::Enhance(args) => args,
            _ => return None,
        })
    }
}

/// Stack of a thread of the pool, bytes: as much as the main thread has, because commands run on these threads.
const STACK: usize = 8 << 20;

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
    ranks::begin()?;
    refuse_other_encodings(&words)?;
    interrupt::listen()?;
    let command_line = words
        .iter()
        .enumerate()
        .map(|(i, w)| if i == 0 { "cittert".to_owned() } else { shell_word(&w.to_string_lossy()) })
        .collect::<Vec<_>>()
        .join(" ");
    let cli = parse(&words)?;
    cli.forecast.check()?;
    if cli.forecast.is_wanted() {
        ranks::refuse_several("a forecast is made by one. Start it without mpirun; --nodes says how many machines are meant")?;
    } else if !cli.command.shares_work() {
        ranks::refuse_several(
            "only dirty, clean, mem, selfcal, simulate, predict, convert and study can share their work. Start this one without mpirun",
        )?;
    }
    let loudness = match (cli.quiet || ranks::is_silent(), cli.verbose) {
        (true, _) => Loudness::Quiet,
        (_, true) => Loudness::Verbose,
        _ => Loudness::Normal,
    };
    let (threads, memory) = ranks::share_machine(cli.threads, cli.memory);
    if let Some(threads) = threads {
        ensure!((1..=1024).contains(&threads), Failure::usage(format!("--threads is {threads}, expected 1 to 1024")));
    }
    // This fails only where a thread pool exists already, as in tests that call this function twice. With 0 the library chooses the number of threads.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(threads.unwrap_or(0)).stack_size(STACK).build_global();
    if let Some(memory) = memory {
        memory.set();
    }
    let context = Context { command_line, console: Console::new(loudness), subcommands: SUBCOMMANDS, ahead: Ahead::default() };
    let forecast = || {
        let there = parse_as(&words, true)?;
        let plans = cli.command.plan().zip(there.command.plan()).ok_or_else(forecast::without)?;
        forecast::forecast(plans, &cli.forecast, (&context, plan_words))
    };
    let outputs = Together::begin();
    let perform = || if cli.forecast.is_wanted() { forecast() } else { cli.command.run(&context) };
    let outcome = guarded(|| cli.command.on_its_threads(perform));
    take_notes().iter().for_each(|note| context.console.note(note));
    let outcome = outcome?;
    // No output gets its name before every process has done its part.
    ranks::all().meet();
    outputs.commit()?;
    context.console.close_log()?;
    print(if cli.json { outcome.json.to_string() } else { outcome.text.trim_end().to_owned() })?;
    match outcome.failed {
        Some(why) => Err(Failure::message(why)),
        None => Ok(()),
    }
}

/// Print a result on stdout.
fn print(text: String) -> Result<()> {
    if text.is_empty() || ranks::is_silent() {
        return Ok(());
    }
    let mut stdout = std::io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        // A reader that has closed the pipe (`| head`) is not an error.
        Err(e) if e.kind() != std::io::ErrorKind::BrokenPipe => Err(e).context("the results cannot be printed on standard output"),
        _ => Ok(()),
    }
}

/// Results, histories and messages are UTF-8 and could not name such a file.
fn refuse_other_encodings(words: &[OsString]) -> Result<()> {
    match words.iter().skip(1).find(|w| w.to_str().is_none()) {
        Some(word) => Err(Failure::usage(format!("{}: this name is not UTF-8, which cittert needs: rename the file", word.display()))),
        None => Ok(()),
    }
}

/// The subcommands, as `run` gets them.
const SUBCOMMANDS: Subcommands =
    Subcommands { check: |words| parse(words).map(drop), run: |words, context| parse(words)?.command.perform(context) };

/// The commands of a configuration of `run`. `path` is the file from which its text was read.
///
/// # Errors
/// The configuration is wrong. The message names the line.
pub fn run_commands(text: &str, path: &Path) -> Result<Vec<String>> {
    run::run_commands(text, path, SUBCOMMANDS.check)
}

/// The forecast of the words of a command line.
fn plan_words(words: &[OsString], planner: &Planner<'_>) -> Result<Told> {
    let cli = parse(words)?;
    cli.command.plan().ok_or_else(forecast::without)?.plan(planner)
}

fn parse(words: &[OsString]) -> Result<Cli> {
    parse_as(words, ranks::by_mpirun())
}

/// Read the words of a command line, with the defaults of what mpirun starts if it does.
fn parse_as(words: &[OsString], by_mpirun: bool) -> Result<Cli> {
    let command = if by_mpirun { ranks::for_mpirun(command()) } else { command() };
    let matches = numbers::limited(command).try_get_matches_from(words)?;
    Ok(Cli::from_arg_matches(&matches)?)
}

/// A panic is an internal error. The user gets one sentence instead of a stack trace.
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
