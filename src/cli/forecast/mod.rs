//! `--dry-run`: what a command would take, without doing it.
//!
//! | file | what it does |
//! |---|---|
//! | `args` | the options |
//! | `first_rows` | the rows on which a command is tried |
//! | `passing` | the work of commands that read rows and write them again |
//! | `rehearsal` | a command that is begun and stopped, which shows how many cycles its data ask for |
//! | `pilot` | the time and the memory of a small part of the work, which is done and thrown away |
//! | `rendered` | the work of rendering a scene of solids, from parts of its picture |
//! | `sampling` | the work of `simulate` and `predict` on a scene |
//! | `told` | what a command tells of its work |
//! | `waves` | the work of spherical waves to a scene near the array, from some of its points |
//! | `report` | a forecast as text and as JSON |
//!
//! The file of each command says how its options become work, in a function `forecast`.

mod args;
mod first_rows;
mod passing;
mod pilot;
mod rehearsal;
mod rendered;
mod report;
mod sampling;
mod told;
mod waves;

pub(super) use args::ForecastArgs;
pub(super) use first_rows::FirstRows;
pub(super) use passing::Passing;
pub(super) use pilot::{Grown, Measured, Scratch, frames_to_make, grown, measured};
pub(super) use rehearsal::{Acts, Ended, Watch};
pub(super) use rendered::{Rendered, rendered};
pub(super) use sampling::Sampling;
pub(super) use told::Told;
pub(super) use waves::{few_points, of_image as waves_of_image, say as say_waves};

use super::console::Console;
use super::context::{Context, Outcome};
use super::failure::{Failure, Result, ensure};
use super::options::SetFiles;
use super::ranks;
use super::slurm::Pilot;
use crate::cost::{Course, Forecast, InputFormat, Pace, Speeds, Tried};
use crate::imaging::{ImagingOptions, Outlook, RowSample};
use crate::memory::{MemoryBudget, free_memory};
use crate::progress::{Event, Observer, Silent};
use cittert_arrays::VisibilitySource;
use cittert_formats::free_disk;
use rehearsal::{FIRST, Rehearsed, rehearse, try_out};
use serde_json::{Map, Value, json};
use std::cell::RefCell;
use std::ffi::OsString;
use std::path::Path;

/// What the commands need to make a forecast.
pub(super) struct Planner<'a> {
    pub(super) args: &'a ForecastArgs,
    pub(super) context: &'a Context,
    /// Speeds of this machine, or those that were given.
    pub(super) speeds: Speeds,
    /// Threads of the process.
    pub(super) threads: usize,
    /// Processes that share the rows: 1 for the forecast of this machine.
    pub(super) ranks: usize,
    /// Makes the forecast of the words of another command line, for commands that start others. Such a command must not use the table of commands.
    pub(super) words: PlanWords,
    /// What a rehearsal has shown on this machine.
    rehearsed: RefCell<Option<Rehearsed>>,
    /// How fast this machine was at what was tried.
    pace: RefCell<Option<Pace>>,
}

/// A function that makes the forecast of the words of a command line.
pub(super) type PlanWords = fn(&[OsString], &Planner<'_>) -> Result<Told>;

/// A command that can be forecast.
pub(super) trait Plan {
    /// The work of the command.
    ///
    /// # Errors
    /// The file or an option is wrong.
    fn plan(&self, planner: &Planner<'_>) -> Result<Told>;

    /// Where the outputs go.
    fn output(&self) -> &Path;
}

impl<'a> Planner<'a> {
    /// For one process on this machine.
    fn new(args: &'a ForecastArgs, context: &'a Context, (speeds, threads): (Speeds, usize), words: PlanWords) -> Self {
        Self { args, context, speeds, threads, ranks: 1, words, rehearsed: RefCell::default(), pace: RefCell::default() }
    }
}

impl Planner<'_> {
    /// The same for commands that start in another context.
    pub(super) fn within<'b>(&'b self, context: &'b Context) -> Planner<'b> {
        Planner { ranks: self.ranks, ..Planner::new(self.args, context, (self.speeds.clone(), self.threads), self.words) }
    }

    /// Refuse several processes, for a command that has no rows to share.
    ///
    /// # Errors
    /// Several processes are meant.
    pub(super) fn alone(&self, why: &str) -> Result<()> {
        ensure!(self.ranks == 1, Failure::usage(format!("--nodes: one process {why}")));
        Ok(())
    }

    /// Refuse another number of visibilities, for a command that has none or makes its own.
    ///
    /// # Errors
    /// A number of visibilities.
    pub(super) fn no_visibilities(&self, why: &str) -> Result<()> {
        ensure!(self.args.visibilities()?.is_none(), Failure::usage(format!("--visibilities: {why}")));
        Ok(())
    }

    /// By how much a set of so many visibilities is to be longer.
    ///
    /// # Errors
    /// A number of visibilities that cannot be.
    pub(super) fn stretch(&self, found: f64) -> Result<f64> {
        Ok(self.args.visibilities()?.map_or(1.0, |n| n / found.max(1.0)))
    }

    /// Rehearse a command whose forecast is `first`, where that shows enough and the memory that is free holds it: `exists` is true where its set does, and `perform` does the work.
    ///
    /// # Errors
    /// The command would fail.
    pub(super) fn rehearsed(
        &self,
        (first, exists): (&Forecast, bool),
        acts: &Acts,
        perform: impl FnOnce(&Watch<'_>) -> Result<Ended>,
    ) -> Result<Option<Rehearsed>> {
        // The course is the same for each of several machines.
        if self.ranks > 1 {
            return Ok(self.rehearsed.borrow().clone());
        }
        let most_s = self.args.rehearsal_s();
        let first_s = first.seconds_of(acts.before, &self.speeds, self.threads);
        if !self.may_try(first, exists)? || first_s > FIRST * most_s {
            return Ok(None);
        }
        let found = self.told_as_rehearsal(|console| rehearse((console, most_s), acts, perform))?;
        self.rehearsed.replace(found.clone());
        Ok(found)
    }

    /// The forecast of a command after its rehearsal, if there was one: `of` makes the forecast of a course.
    pub(super) fn after(&self, rehearsed: Option<&Rehearsed>, first: Forecast, of: &dyn Fn(Course) -> Forecast) -> Forecast {
        let Some(rehearsed) = rehearsed else { return first };
        if self.ranks == 1 {
            self.keep_pace(&rehearsed.tried, &of(Course { ended: true, ..rehearsed.course }));
        }
        self.at_pace(of(rehearsed.course))
    }

    /// The forecast `first` of a command at the pace of this machine: `perform` does its `stages` for so many of the rows of its set, and writes into a folder that is removed
    /// afterwards. `of` makes the forecast of so many rows. `exists` is true where the set does, and `state` is what both work with.
    ///
    /// # Errors
    /// The command would fail.
    pub(super) fn tried<S: ?Sized>(
        &self,
        (first, exists): (Forecast, bool),
        (stages, rows): (&[&'static str], usize),
        state: &mut S,
        of: impl Fn(&mut S, usize) -> Result<Forecast>,
        perform: impl FnOnce(&mut S, usize, (&Path, &Watch<'_>)) -> Result<()>,
    ) -> Result<Forecast> {
        let most_s = self.args.rehearsal_s();
        let (said, enough) = (first.seconds_of(stages, &self.speeds, self.threads), FIRST * most_s);
        let n = if said > enough { (rows as f64 * enough / said) as usize } else { rows };
        if n == 0 || !self.is_this_machine() || !self.may_try(&first, exists)? {
            return Ok(self.at_pace(first));
        }
        let part = if n < rows { of(state, n)? } else { first.clone() };
        // Images whose pixels alone take too long are left alone.
        let short = part.seconds_of(stages, &self.speeds, self.threads) <= most_s;
        let Some(scratch) = Scratch::with_room(first.output_bytes).filter(|_| short) else { return Ok(first) };
        let done = self.told_as_rehearsal(|console| try_out((console, most_s), |watch| perform(state, n, (scratch.path(), watch))))?;
        let mut forecast = first;
        if let Some((seconds, ())) = done {
            self.keep_pace(&[Tried { stages: stages.to_vec(), seconds }], &part);
            forecast.assumptions.push(format!("all rows take the time that a rehearsal of {n} of {rows} says, on this machine"));
        }
        Ok(self.at_pace(forecast))
    }

    /// True where a command whose forecast is `first` may be tried here.
    fn may_try(&self, first: &Forecast, exists: bool) -> Result<bool> {
        let fits = || free_memory().is_none_or(|free| first.peak_bytes(&self.speeds) <= free as f64);
        let alone = self.ranks == 1 && ranks::all().size() == 1;
        Ok(alone && exists && self.args.visibilities()?.is_none() && self.args.rehearsal_s() > 0.0 && fits())
    }

    /// True where the forecast is for this machine. The speeds of another one are taken as they are, and so are those of a job with other threads.
    fn is_this_machine(&self) -> bool {
        !self.args.has_speeds() && self.threads == rayon::current_num_threads()
    }

    /// Keep the pace of what was tried, where `part` is its forecast.
    fn keep_pace(&self, tried: &[Tried], part: &Forecast) {
        if self.is_this_machine() {
            self.pace.replace(Some(Pace::new(tried, (part, &self.speeds, self.threads))));
        }
    }

    /// A forecast at the pace that is known, if there is one. It is the same for each of several machines.
    fn at_pace(&self, forecast: Forecast) -> Forecast {
        match &*self.pace.borrow() {
            Some(pace) => forecast.at_pace(pace),
            None => forecast,
        }
    }

    fn told_as_rehearsal<T>(&self, work: impl FnOnce(&Console) -> T) -> T {
        let console = &self.context.console;
        console.event(Event::Phase { name: "rehearsal", total: None, unit: "" });
        // The command takes its memory from the system, so the rehearsal does too.
        Pilot::forget_memory();
        let done = work(console);
        console.event(Event::Done);
        done
    }

    /// Look at a set and its image. With several processes the outlook is that of one of them.
    ///
    /// # Errors
    /// The file or an option is wrong.
    pub(super) fn outlook(&self, source: &mut dyn VisibilitySource, imaging: &ImagingOptions) -> Result<(Outlook, RowSample)> {
        let n = self.args.visibilities()?;
        if self.ranks < 2 {
            return Ok(Outlook::of(source, imaging, n, &self.context.console)?);
        }
        let part = self.args.cluster(self.threads)?.map_or(0.0, |c| c.node_bytes / c.ranks_per_node as f64 / 2.0);
        let memory =
            MemoryBudget::new(part as u64).map_err(|_| Failure::usage("--node-memory: less than 16 MiB for the data of each process"))?;
        let imaging = ImagingOptions { memory, ..imaging.clone() };
        let (outlook, sample) = Outlook::of(source, &imaging, n, &Silent)?;
        Ok((outlook.shared(self.ranks, memory), sample))
    }
}

/// The format of a set. Sets that a command of the same forecast would write are UVH5.
///
/// # Errors
/// A file of no known format.
pub(super) fn format_of(input: &SetFiles, context: &Context) -> Result<InputFormat> {
    let first = input.all().first().ok_or_else(|| Failure::message("no file"))?;
    if context.ahead.get(first).is_some() {
        return Ok(InputFormat::Uvh5);
    }
    Ok(match cittert_formats::visibility_format(first)?.name() {
        "UVH5" => InputFormat::Uvh5,
        "UVFITS" => InputFormat::Uvfits,
        _ => InputFormat::Ms,
    })
}

/// What is said about the image of a set.
pub(super) fn facts(outlook: &Outlook) -> Map<String, Value> {
    let (rows, channels, products) = outlook.shape;
    let size = &outlook.image.size;
    let mut facts = Map::new();
    let mut say = |name: &str, value: Value| facts.insert(name.to_owned(), value);
    say("rows", rows.into());
    say("channels", channels.into());
    say("products", products.into());
    say("visibilities", outlook.visibilities().into());
    say("in_memory", outlook.kept.into());
    say("size", json!([outlook.grid.n_l, outlook.grid.n_m]));
    say("cell_rad", outlook.grid.cell_rad.into());
    say("channels_out", outlook.channels_out.into());
    say("grid", json!([size.padded.0, size.padded.1]));
    say("kernel_cells", size.support.into());
    say("w_planes", size.planes.into());
    say("groups_of_planes", size.groups.into());
    facts
}

/// The forecast of a command here, and on a cluster if one is asked for: `several` has the defaults of the processes that mpirun starts.
///
/// # Errors
/// The file or an option is wrong.
pub(super) fn forecast(
    (command, several): (&dyn Plan, &dyn Plan),
    args: &ForecastArgs,
    (context, words): (&Context, PlanWords),
) -> Result<Outcome> {
    // What the forecast itself takes comes after this.
    let start_bytes = Pilot::memory().0 as f64;
    let given = args.speeds()?;
    let speeds = match given {
        Some(speeds) => speeds,
        None => speeds_here()?,
    }
    .with_program(start_bytes);
    let threads = rayon::current_num_threads();
    let mut planner = Planner::new(args, context, (speeds, threads), words);
    let here = command.plan(&planner)?;
    let disk = free_disk(command.output());
    let Some(cluster) = args.cluster(threads)? else {
        return Ok(report::outcome(&here, (&planner.speeds, threads), None, disk));
    };
    planner.ranks = cluster.ranks();
    let part = several.plan(&planner)?;
    let shared = cluster.share(&part.forecast, &planner.speeds);
    Ok(report::outcome(&here, (&planner.speeds, threads), Some((&cluster, &shared)), disk))
}

/// The time and the memory of a command on this machine, for a job that runs it on so many threads.
///
/// # Errors
/// The file or an option is wrong.
pub(super) fn need(command: &dyn Plan, context: &Context, threads: usize) -> Result<(f64, f64)> {
    let start_bytes = Pilot::memory().0 as f64;
    let speeds = speeds_here()?.with_program(start_bytes);
    let args = ForecastArgs::default();
    let planner = Planner::new(&args, context, (speeds, threads), |_, _| Err(without()));
    let told = command.plan(&planner)?;
    Ok((told.forecast.seconds(&planner.speeds, threads), told.forecast.peak_bytes(&planner.speeds)))
}

/// The speeds of this machine. Memory of the short tests is given back: files are looked at by a copy of the process, after which Linux copies each page that is written
/// again, and a rehearsal on several threads would take a third longer.
fn speeds_here() -> Result<Speeds> {
    let speeds = Speeds::here()?;
    Pilot::forget_memory();
    Ok(speeds)
}

/// The refusal of a command without a forecast: what can be forecast.
pub(super) fn without() -> Failure {
    Failure::usage(
        "--dry-run: there is a forecast for run, dirty, beam, grid, clean, mem, selfcal, simulate, predict, focus, corrupt, applycal, closure, mask, convert, study, scene render, scene fly, film and enhance. info, plot, compare, identify, sensor, design, layouts and tables have none, because they take little time, or as long as they are told to: start this command without it",
    )
}
