//! `mem --terms --dry-run`: what an image from closure quantities would take, from a few evaluations of its very data.
//!
//! Such sets are small, so all of the data are gathered. Two short runs, which differ in the number of their iterations, tell the time of an evaluation and of all that a run
//! does beside.

use super::args::MemCommandArgs;
use super::closures::options;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::forecast::{Planner, Told, measured};
use crate::closure_imaging::{ClosureImagingOptions, FluxFrom, SparseSet, Term, reconstruct};
use crate::cost::{self, ClosureWork};
use crate::progress::Silent;
use cittert_arrays::{SkyFrame, SkyGrid};
use serde_json::{Map, json};

/// Iterations of the short runs, and by how much longer the second one becomes until it takes so many seconds.
const ITERATIONS: [usize; 2] = [3, 15];
const MORE: usize = 3;
const ENOUGH_S: f64 = 0.2;

/// The forecast of an image from closure quantities.
///
/// # Errors
/// The file or an option is wrong, or the set does not exist yet.
pub(super) fn plan(args: &MemCommandArgs, planner: &Planner<'_>) -> Result<Told> {
    planner.alone("makes an image from closure quantities")?;
    planner.no_visibilities("closure quantities are averages of those of a set")?;
    let input = args.input.files()?;
    ensure!(
        input.exist(planner.context),
        Failure::unforeseen("--dry-run: closure quantities are looked at themselves, and the set is not made yet")
    );
    let what = format!("imaging {input}");
    let mut source = input.open_chosen(&args.column, planner.context)?;
    let options = options(args, source.header().unit).context(&what)?;
    let mut gathered = || SparseSet::gather(source.as_mut(), options.polarization, options.average, options.systematic, &Silent);
    let gathered = measured(|| Ok(gathered()?)).context(&what)?;
    let (set, header) = (gathered.result, source.header());
    let frame = header.phase_centers.get(set.phase_center).map_or(SkyFrame::Boresight, SkyGrid::frame_of);
    let flux = if let FluxFrom::Given(flux) = options.flux { flux } else { 1.0 };
    let run = |iterations: usize| {
        let short =
            ClosureImagingOptions { rounds: 1, selfcal_rounds: 0, iterations, starts: 1, flux: FluxFrom::Given(flux), ..options.clone() };
        measured(|| Ok(reconstruct(&set, frame.clone(), &short, &Silent)?)).context(&what)
    };
    let (few, mut iterations) = (run(ITERATIONS[0])?, ITERATIONS[1]);
    let mut many = run(iterations)?;
    while many.seconds < ENOUGH_S && iterations < options.iterations {
        iterations *= MORE;
        many = run(iterations)?;
    }
    let more = many.result.evaluations.saturating_sub(few.result.evaluations).max(1) as f64;
    let evaluation_s = (many.seconds - few.seconds).max(0.0) / more;
    let grid = &many.result.grid;
    let selfcal_rounds = if options.weight(Term::Visibility) > 0.0 { options.selfcal_rounds } else { 0 };
    let trials = if options.flux == FluxFrom::Likelihood { options.tuning.fluxes.len() } else { 0 };
    let work = ClosureWork {
        gather_s: gathered.seconds,
        begin_s: (few.seconds - few.result.evaluations as f64 * evaluation_s).max(0.0),
        evaluation_s,
        starts: options.starts as f64,
        iterations: (options.iterations * (options.rounds + selfcal_rounds)) as f64,
        trial_iterations: (trials * options.tuning.trial_rounds * options.tuning.trial_iterations) as f64,
        held_bytes: few.held_bytes.max(many.held_bytes).max(gathered.held_bytes),
        pixels: (grid.n_l * grid.n_m) as f64,
        threads: planner.threads as f64,
    };
    let values = (source.n_rows() * header.spectrum.n_chan() * header.polarizations.len()) as f64;
    let forecast = cost::closures(&work, values);
    let mut facts = Map::new();
    facts.insert("size".into(), json!([grid.n_l, grid.n_m]));
    facts.insert("cell_rad".into(), grid.cell_rad.into());
    facts.insert("data".into(), many.result.n_vis.into());
    facts.insert("evaluation_s".into(), evaluation_s.into());
    Ok(Told { command: "mem", forecast, facts })
}
