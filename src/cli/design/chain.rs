//! From a state of the page to visibilities and images, by the calls of the subcommands.

use super::scenes::Scenes;
use super::state::{MOST_VISIBILITIES, State, check_pixels};
use crate::calibrate::{Beginning, Calibrated, CandidateOptions, apply, calibrate, candidates};
use crate::cli::airs::Airs;
use crate::cli::context::Context;
use crate::cli::failure::{Failure, Result, ensure};
use crate::cli::options::LoadedScene;
use crate::corrupt::{CorruptOptions, corrupt_with, corrupted_header};
use crate::imaging::major::clean;
use crate::imaging::{CleanProducts, Imager, dirty_image, psf_image};
use crate::mem::{MemInputs, MemProducts, mem};
use crate::progress::{Observer, Silent};
use crate::simulate::{PlannedTrack, SkyModel, simulate_set};
use cittert_arrays::{
    ArrayLayout, CoveragePlan, GainTable, Image, PhaseCenter, Source, SpectralWindow, VisUnit, VisibilitySet, VisibilitySource,
};
use std::sync::Arc;

/// The name of the scene of a state that has none.
pub(super) const POINT: &str = "point";

/// A planned observation.
pub(super) struct Planned {
    pub(super) layout: ArrayLayout,
    pub(super) spectrum: SpectralWindow,
    pub(super) center: PhaseCenter,
    pub(super) plan: CoveragePlan,
}

/// Plan the observation of a state.
///
/// # Errors
/// A layout or an option that is wrong, or more visibilities than a page computes.
pub(super) fn plan(state: &State) -> Result<Planned> {
    let layout = state.array()?;
    let options = &state.simulate.options;
    let spectrum = options.band.spectrum().map_err(Failure::call)?;
    let PlannedTrack { center, plan } = options.track.plan(&layout).map_err(Failure::call)?;
    let visibilities = (plan.n_rows() as u64).saturating_mul((spectrum.n_chan() * options.how.pols.len()) as u64);
    let text = format!(
        "the observation has {visibilities} visibilities, and the page computes at most {MOST_VISIBILITIES}: choose fewer antennas, channels or integrations"
    );
    ensure!(visibilities <= MOST_VISIBILITIES, Failure::message(text));
    ensure!(
        plan.n_rows() > 0,
        Failure::message("no antenna sees the phase centre at any time: lower the elevation limit, or move the track")
    );
    options.how.pattern(&layout).map_err(Failure::call)?;
    Ok(Planned { layout, spectrum, center, plan })
}

/// The scene of a state; a point of 1 Jy where it has none.
///
/// # Errors
/// There is no such scene, or an option that it needs is missing.
pub(super) fn scene(state: &State, planned: &Planned, scenes: &Scenes, context: &Context) -> Result<Arc<LoadedScene>> {
    let section = state.scene.as_ref().map(|s| &s.options);
    match section.and_then(|s| Some((s.file.as_ref()?, s))) {
        Some((file, section)) => scenes.load((&file.display().to_string(), &section.how), &planned.center, &planned.spectrum, context),
        None => {
            let sky = SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0)]);
            Ok(Arc::new(LoadedScene { sky, unit: VisUnit::Jy, name: POINT.into() }))
        }
    }
}

/// The visibilities without errors, as `simulate` makes them.
///
/// # Errors
/// As `simulate`, and a newer state.
pub(super) fn simulated(state: &State, planned: &Planned, scene: &LoadedScene, observer: &dyn Observer) -> Result<VisibilitySet> {
    let mut how = state.simulate.options.how.clone();
    how.seed = state.seed;
    let mut center = planned.center.clone();
    center.name.clone_from(&scene.name);
    let header = how.header(planned.layout.clone(), planned.spectrum.clone(), center, scene.unit);
    Ok(simulate_set(header, &planned.plan.coverage()?, &scene.sky, &how, observer)?)
}

/// An observation of a point, for its weights: they are there before those of the scene. `None` where the weights depend on the scene or on errors.
///
/// # Errors
/// As `simulate`, and a newer state.
pub(super) fn weighed(state: &State, planned: &Planned, unit: VisUnit, observer: &dyn Observer) -> Result<Option<VisibilitySet>> {
    if has_errors(state) || state.simulate.options.how.scene_noise {
        return Ok(None);
    }
    let point = LoadedScene { sky: SkyModel::of_sources(vec![Source::point(0.0, 0.0, 1.0)]), unit, name: POINT.into() };
    simulated(state, planned, &point, observer).map(Some)
}

/// True where a state puts errors into the data.
pub(super) fn has_errors(state: &State) -> bool {
    // Which errors there are does not depend on the unit.
    state.corrupt.options.errors(VisUnit::Jy, &Airs).is_ok_and(|errors| !errors.is_empty())
}

/// The data of an observation with the errors of a state, and the true gains.
///
/// # Errors
/// As `corrupt`.
pub(super) fn corrupted(state: &State, set: &mut VisibilitySet) -> Result<Option<(VisibilitySet, GainTable)>> {
    let errors = state.corrupt.options.errors(set.header.unit, &Airs).map_err(Failure::call)?;
    if errors.is_empty() {
        return Ok(None);
    }
    let options = CorruptOptions { seed: state.seed, errors, per_feed: state.corrupt.options.per_feed };
    let mut out = VisibilitySet::new(corrupted_header(&set.header, &options), set.data.rows(0..0)?)?;
    let truth = corrupt_with(set, &mut out, &options, None, &Silent)?;
    Ok(Some((out, truth.gains)))
}

/// Self-calibrate as `selfcal` does, and return the calibrated data too.
///
/// # Errors
/// As `selfcal`, and a newer state.
pub(super) fn calibrated(state: &State, set: &mut VisibilitySet, observer: &dyn Observer) -> Result<Option<(Calibrated, VisibilitySet)>> {
    let Some(section) = &state.selfcal else { return Ok(None) };
    let of = &section.options;
    of.rounds.check().map_err(Failure::call)?;
    of.solve.check(set.header.layout.n_ant()).map_err(Failure::call)?;
    let grid = Imager::grid_of(set, &state.image.options, observer)?;
    let clean = of.clean.clone().with_region(None, &grid)?;
    let ways = candidates(&CandidateOptions::new(
        state.image.options.on_grid(&grid),
        clean,
        of.solve.clone(),
        of.rounds.clone(),
        set.header.unit,
    ))?;
    let (result, _) = calibrate(set, &ways, Beginning::Data, &of.rounds.judge(), observer)?;
    let mut out = VisibilitySet::new(set.header.clone(), set.data.rows(0..0)?)?;
    apply(set, &result.gains, of.rounds.apply(), &mut out, observer)?;
    Ok(Some((result, out)))
}

/// The dirty beam, as `beam` makes it.
///
/// # Errors
/// As `beam`.
pub(super) fn psf(imager: &mut Imager<'_>) -> Result<(Image<f32>, Vec<cittert_arrays::RestoringBeam>)> {
    Ok(psf_image(imager, &Silent)?)
}

/// The dirty image, as `dirty` makes it.
///
/// # Errors
/// As `dirty`.
pub(super) fn dirty(imager: &mut Imager<'_>) -> Result<Image<f32>> {
    Ok(dirty_image(imager, true, &Silent)?)
}

/// An imager with the options of a state.
///
/// # Errors
/// An option that is wrong, or data that cannot be imaged.
pub(super) fn imager<'a>(state: &State, set: &'a mut dyn VisibilitySource) -> Result<Imager<'a>> {
    let imager = Imager::new(set, state.image.options.clone(), &Silent)?;
    check_pixels("the image", (imager.grid().n_l, imager.grid().n_m))?;
    Ok(imager)
}

/// CLEAN, as `clean` does it.
///
/// # Errors
/// As `clean`, and a newer state.
pub(super) fn cleaned(state: &State, set: &mut VisibilitySet, observer: &dyn Observer) -> Result<Option<CleanProducts>> {
    let Some(section) = &state.clean else { return Ok(None) };
    let mut imager = imager(state, set)?;
    let options = section.options.clone().with_region(None, imager.grid())?;
    Ok(Some(clean(&mut imager, &options, observer)?))
}

/// Maximum entropy, as `mem` does it.
///
/// # Errors
/// As `mem`, and a newer state.
pub(super) fn entropic(state: &State, set: &mut VisibilitySet, observer: &dyn Observer) -> Result<Option<MemProducts>> {
    let Some(section) = &state.mem else { return Ok(None) };
    section.options.check().map_err(Failure::call)?;
    let noise = section.options.believed_noise(set, observer)?;
    let mut imager = imager(state, set)?;
    let plan = section.options.plan(&imager, MemInputs::default(), noise)?;
    Ok(Some(mem(&mut imager, &plan, observer)?))
}
