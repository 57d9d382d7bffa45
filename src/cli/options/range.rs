//! `--range`: maps of distances from files and from traced scenes.

use super::scene::{SceneArgs, read_scene};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::forecast::rendered;
use crate::cost::Traced;
use crate::imaging::ImagingOptions;
use crate::nearfield::{RangeChoice, RangeMap, Surface};
use crate::simulate::SkyModel;
use cittert_arrays::{BrightnessUnit, Image, NearField, Polarization, SpectralWindow};
use cittert_phenomenology::{RenderOptions, Scene, SolidScene, View};
use ndarray::{Array4, Axis};
use std::path::Path;

/// The file of a range, where it is one.
#[must_use]
pub fn range_file(choice: &RangeChoice) -> Option<&Path> {
    if let RangeChoice::File(path) = choice { Some(path) } else { None }
}

/// The map of distances of a file.
///
/// # Errors
/// A file that holds no image of distances.
pub fn range_map(path: &Path) -> Result<Surface> {
    let image = cittert_formats::open_image(path)?;
    let name = path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
    Ok(Surface::Map(RangeMap::new(&name, &image).context(path.display())?.into()))
}

/// The surface of a model of a set that says this of the near field.
///
/// # Errors
/// A file that holds no distances, a set that does not say where its scene is.
pub fn model_surface(choice: &RangeChoice, near: &NearField) -> Result<Surface> {
    range_file(choice).map_or_else(|| Ok(choice.surface_of(near)?), range_map)
}

/// Options of an image with their map of distances loaded, where they name one.
///
/// # Errors
/// A file that holds no image of distances.
pub fn with_range(imaging: &ImagingOptions) -> Result<ImagingOptions> {
    let surface = imaging.range.as_ref().and_then(range_file).map(range_map).transpose()?;
    Ok(ImagingOptions { surface, ..imaging.clone() })
}

/// Refuse a range where images are made by Fourier transforms alone.
///
/// # Errors
/// A range.
pub fn no_range(imaging: &ImagingOptions, instead: &str) -> Result<()> {
    let given = imaging.range.as_ref().map(ToString::to_string);
    ensure!(given.is_none(), Failure::usage(format!("--range is {}, expected no range: {instead}", given.unwrap_or_default())));
    Ok(())
}

/// The surface of a scene that is simulated.
///
/// # Errors
/// A file that holds no distances, or a scene without distances of its own.
pub fn scene_surface(
    choice: Option<&RangeChoice>,
    scene: &SceneArgs,
    sky: &SkyModel,
    spectrum: &SpectralWindow,
) -> Result<Option<Surface>> {
    match choice {
        None => Ok(None),
        Some(RangeChoice::File(path)) => range_map(path).map(Some),
        Some(RangeChoice::Auto) => traced(scene, sky, spectrum).map(Some),
        Some(choice) => Ok(choice.surface().map_err(Failure::call)?),
    }
}

/// The surface of a scene as a forecast needs it, and what it takes to find it. Distances that rays would find are taken to be those of the far field: they
/// change no time.
///
/// # Errors
/// As [`scene_surface`].
pub fn foreseen_surface(
    choice: Option<&RangeChoice>,
    scene: &SceneArgs,
    sky: &SkyModel,
    spectrum: &SpectralWindow,
) -> Result<(Option<Surface>, Traced)> {
    if !matches!(choice, Some(RangeChoice::Auto)) {
        return Ok((scene_surface(choice, scene, sky, spectrum)?, Traced::default()));
    }
    let (solids, view, band) = looked_at(scene, sky, spectrum)?;
    let seen = rendered(&solids, &view, &band, &first_hits(), None).context(scene.scene.display())?;
    let far = Array4::from_elem((1, 1, view.grid().n_m, view.grid().n_l), f64::NAN);
    let map = Image::new(view.grid().clone(), band, vec![Polarization::I], far, BrightnessUnit::Metre)?;
    let surface = Surface::Map(RangeMap::new(solids.name(), &map).context(scene.scene.display())?.into());
    Ok((Some(surface), Traced { setup_s: seen.setup_s, trace_s: seen.trace_s, bytes: seen.bytes, written: 0.0 }))
}

/// A scene of solids, the view of it that its image has, and its band.
fn looked_at(args: &SceneArgs, sky: &SkyModel, spectrum: &SpectralWindow) -> Result<(Box<SolidScene>, View, SpectralWindow)> {
    let path = &args.scene;
    let toml = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let scene = if toml { Some(read_scene(path)?) } else { None };
    let (Some(Scene::Solids(solids)), Some(image)) = (scene, sky.images.first()) else {
        return Err(Failure::usage(format!(
            "{}: --range auto takes the distances of a scene of solids (TOML); give a distance such as 10m, or the FITS image of distances that scene render --range writes",
            path.display()
        )));
    };
    let band = SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?;
    let view = View::on_grid(solids.camera().context(path.display())?, &image.grid).context(path.display())?;
    Ok((solids, view, band))
}

/// Only the first hit of the ray through the middle of each pixel counts.
fn first_hits() -> RenderOptions {
    RenderOptions { antialias: 1, max_bounces: 1, ..RenderOptions::default() }
}

/// The distances of a scene of solids at the pixels of its image.
fn traced(args: &SceneArgs, sky: &SkyModel, spectrum: &SpectralWindow) -> Result<Surface> {
    let path = &args.scene;
    let (solids, view, band) = looked_at(args, sky, spectrum)?;
    let picture = solids.picture(&view, &band, &first_hits()).context(path.display())?;
    let plane = picture.range_m.insert_axis(Axis(0)).insert_axis(Axis(0));
    ensure!(
        plane.iter().any(|d| d.is_finite()),
        Failure::message(format!("{}: the scene has no surface in its field, so it has no distances", path.display()))
    );
    let map = Image::new(view.grid().clone(), band, vec![Polarization::I], plane, BrightnessUnit::Metre)?;
    Ok(Surface::Map(RangeMap::new(solids.name(), &map).context(path.display())?.into()))
}
