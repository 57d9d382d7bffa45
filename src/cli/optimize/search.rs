//! One search: its options, its problem, its journal, and the best layout.

use super::inputs::{Inputs, Kind, PlaceArgs};
use super::journal::Journal;
use super::scene::SceneTestArgs;
use crate::cli::context::Context;
use crate::cli::failure::{Failure, Result};
use crate::cli::options::OutputArgs;
use crate::design::{DesignOptions, Found, Polygon, Problem, Searched, attempt, attempt_pads, search};
use crate::progress::Observer;
use crate::{ChainError, Result as ChainResult};
use cittert_arrays::ArrayLayout;
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Options of `layout optimize`.
#[derive(Debug, Args)]
pub struct OptimizeArgs {
    #[command(flatten)]
    pub(super) place: PlaceArgs,
    #[command(flatten)]
    pub(super) design: DesignOptions,
    #[command(flatten, next_help_heading = "Objective scene")]
    pub(super) scene: SceneTestArgs,
    /// Search N weightings of two objectives instead of one, and write the layouts that no other beats in both, as PATH-1.toml and so on.
    #[arg(long, value_name = "N", conflicts_with = "page")]
    pub(super) pareto: Option<usize>,
    /// Write a page with the layout, its side lobes and the scores of all attempts.
    #[arg(long, value_name = "HTML")]
    pub(super) page: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

impl OptimizeArgs {
    /// The files that are read.
    pub(super) fn inputs(&self) -> Vec<PathBuf> {
        self.place.files().into_iter().chain(self.scene.file()).collect()
    }
}

/// A search that has ended.
pub(super) struct Ended {
    pub(super) problem: Problem,
    pub(super) searched: Searched,
    pub(super) journal: Journal,
    /// Attempts that were in the journal at the start.
    pub(super) resumed: usize,
}

/// Search for the layout that is written to `path`.
pub(super) fn search_one(args: &OptimizeArgs, design: &DesignOptions, inputs: &Inputs, path: &Path, context: &Context) -> Result<Ended> {
    let control = design.control().map_err(Failure::call)?;
    let mut kind = inputs.kind(design).map_err(Failure::call)?;
    kind.problem_mut().setting.scene = args.scene.error(design, inputs.aperture_m, context)?;
    let mut journal_path = path.as_os_str().to_owned();
    journal_path.push(".journal");
    let journal_path = PathBuf::from(journal_path);
    let elements = kind.problem().freedom.elements();
    let fingerprint = fingerprint(args, design, inputs)?;
    let (journal, done) = Journal::open(&journal_path, &fingerprint, elements, args.out.overwrite, context)?;
    let resumed = done.len();
    if resumed > 0 {
        context.console.note(&format!("{}: {resumed} attempts are in the journal already", journal_path.display()));
    }
    let (observer, seed): (&dyn Observer, u64) = (&context.console, design.seed);
    let journal = Mutex::new(journal);
    let lost = || ChainError::Internal("the journal is not usable after a failure".into());
    let keep = |found: &Found| -> ChainResult<()> { journal.lock().map_err(|_| lost())?.append(found) };
    let result = match &kind {
        Kind::Free { problem, method, start } => {
            let one = |k: u64, elite: &[Found]| attempt(problem, method, start.as_deref(), seed, k, elite, observer);
            search(control, done, &one, &keep, observer)
        }
        Kind::Pads { problem, pads } => {
            search(control, done, &|k, elite| attempt_pads(problem, pads, seed, k, elite, observer), &keep, observer)
        }
    };
    let searched = result.map_err(Failure::call)?;
    Ok(Ended { problem: kind.into_problem(), searched, journal: journal.into_inner().map_err(|_| lost())?, resumed })
}

/// What must be the same for a journal to fit: the version, and all that the result depends on. The number of attempts and the time may differ.
fn fingerprint(args: &OptimizeArgs, design: &DesignOptions, inputs: &Inputs) -> Result<String> {
    let design = DesignOptions { restarts: None, time: None, ..design.clone() };
    Ok(format!(
        "cittert {} layout optimize {} {}",
        env!("CARGO_PKG_VERSION"),
        serde_json::to_string(&design)?,
        inputs.fingerprint() + &args.scene.fingerprint()?
    ))
}

/// The name of the layout: that of its file.
pub(super) fn name(path: &Path) -> String {
    path.file_stem().map_or_else(|| "optimized".into(), |s| s.to_string_lossy().into_owned())
}

/// Is told of each attempt, with a function that makes its layout.
pub type Each<'a> = &'a (dyn Fn(&Found, &dyn Fn(&Found) -> ChainResult<ArrayLayout>) -> ChainResult<()> + Sync);

/// Search from a layout in memory, as the command does with this layout as its start and these polygons to keep out of. Nothing is written.
///
/// # Errors
/// An option that is wrong, or a request to stop.
pub fn search_from(
    start: &ArrayLayout,
    keep_out: &[Polygon],
    design: &DesignOptions,
    each: Each<'_>,
    observer: &dyn Observer,
) -> Result<()> {
    let inputs = Inputs::starting(start.clone(), keep_out.to_vec(), design)?;
    let control = design.control().map_err(Failure::call)?;
    let Kind::Free { problem, method, start } = inputs.kind(design).map_err(Failure::call)? else {
        return Err(Failure::message("the page moves elements, and chooses no pads"));
    };
    let layout = |found: &Found| {
        inputs.layout("optimized".into(), &found.xy, "cittert design".into(), (None, None)).map_err(|e| ChainError::Internal(e.to_string()))
    };
    let one = |k: u64, elite: &[Found]| attempt(&problem, method, start.as_deref(), design.seed, k, elite, observer);
    search(control, Default::default(), &one, &|found| each(found, &layout), observer).map(drop).map_err(Failure::call)
}
