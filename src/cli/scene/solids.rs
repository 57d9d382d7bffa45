//! `scene render` for scenes of solids: the full model with its maps, or the real-time mode with its error.

use super::image::{Mode, RenderArgs, outcome};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result};
use crate::progress::{Event, Observer};
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyGrid, SpectralWindow};
use cittert_phenomenology::camera::Projection;
use cittert_phenomenology::trace::{Picture, error_map};
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use ndarray::{Array2, Axis};
use std::path::Path;
use std::time::Instant;

/// Render a scene of solids.
///
/// # Errors
/// Options that exclude each other, a scene that cannot be rendered, or an error of the file system.
pub(super) fn run(
    args: &RenderArgs,
    scene: SolidScene,
    center: &PhaseCenter,
    spectrum: &SpectralWindow,
    context: &Context,
) -> Result<Outcome> {
    let named = || args.scene.display().to_string();
    let scene = args.tracer.scene(scene).context(named())?;
    let view = view(args, &scene, center).context(named())?;
    let options = args.tracer.options(spectrum.n_chan() > 1);
    if args.mode == Mode::Realtime {
        return realtime(args, &scene, &view, spectrum, &options, context);
    }
    if args.error_map.is_some() {
        return Err(Failure::usage("--error-map compares the real-time mode with the full model; give it with --mode realtime"));
    }
    let picture = full(&scene, &view, spectrum, &options, context).context(named())?;
    let mut image = picture.temperature.clone();
    note_projection(&mut image, args, &scene);
    args.write(&args.out.output, &mut image, context.history())?;
    let mut outcome = outcome(&image, scene.name(), args);
    outcome.json["rays"] = picture.rays.into();
    for (path, map) in args.maps().into_iter().zip(maps(picture)) {
        if let Some(path) = path {
            map.write(args, path, &image, context)?;
            outcome = outcome.wrote(path);
        }
    }
    Ok(outcome)
}

/// The view on a grid of direction cosines where a cell is given, otherwise in the projection of the camera.
fn view(args: &RenderArgs, scene: &SolidScene, center: &PhaseCenter) -> Result<View> {
    let camera = scene.camera()?;
    Ok(match (args.scene_size, args.scene_cell) {
        (Some(size), Some(cell)) => View::on_grid(camera, &SkyGrid::new(size, size, cell.si(), SkyGrid::frame_of(center))?)?,
        (Some(size), None) => View::of_camera(&camera.with_side(size))?,
        (None, None) => View::of_camera(camera)?,
        (None, Some(_)) => return Err(Failure::usage("--scene-cell needs --scene-size")),
    })
}

fn full(scene: &SolidScene, view: &View, spectrum: &SpectralWindow, options: &RenderOptions, context: &Context) -> Result<Picture> {
    let passes = if options.antialias > 1 { 2 } else { 1 };
    let rows = (passes * view.grid().n_m) as u64;
    context.console.event(Event::Phase { name: "tracing", total: Some(rows), unit: "rows" });
    let tell = |_: usize, _: usize| context.console.event(Event::Advance(1));
    let picture = scene.picture_observed(view, spectrum, options, Some(&tell));
    context.console.event(Event::Done);
    Ok(picture?)
}

/// Render one frame in the real-time mode, with its error map if the options select one.
fn realtime(
    args: &RenderArgs,
    scene: &SolidScene,
    view: &View,
    spectrum: &SpectralWindow,
    options: &RenderOptions,
    context: &Context,
) -> Result<Outcome> {
    if options.polarizations.len() != 1 || options.per_channel || args.maps().iter().any(Option::is_some) {
        return Err(Failure::usage("--mode realtime renders one plane: give one --pol and one channel, and use --mode full for maps"));
    }
    let named = || args.scene.display().to_string();
    let tracer = Tracer::new(scene, &[spectrum.mean_hz()], options).context(named())?;
    let mesh = args.mesh.options(options.antialias > 1);
    let started = Instant::now();
    let frame = tracer.frame(view, &mesh).context(named())?;
    let seconds = started.elapsed().as_secs_f64();
    let band = mean_band(spectrum)?;
    let data = frame.temperature_k.clone().insert_axis(Axis(0)).insert_axis(Axis(0));
    let mut image = Image::new(view.grid().clone(), band.clone(), options.polarizations.clone(), data, BrightnessUnit::Kelvin)?;
    image.object = scene.name().to_owned();
    note_projection(&mut image, args, scene);
    args.write(&args.out.output, &mut image, context.history())?;
    let mut outcome = outcome(&image, scene.name(), args);
    outcome.json["rays"] = frame.rays.into();
    outcome.json["frame_s"] = seconds.into();
    outcome.json["table_error_k"] = tracer.table_error_k().into();
    outcome.text += &format!(
        "\n{} rays for {} pixels, {:.1} ms, tables within {:.4} K",
        frame.rays,
        image.data.len(),
        1e3 * seconds,
        tracer.table_error_k()
    );
    if let Some(path) = &args.error_map {
        let picture = full(scene, view, &band, options, context).context(named())?;
        let Some((map, rms_k)) = error_map(&frame, picture.temperature.plane(0, 0)) else {
            return Err(Failure::message("the frame and the full model have different sizes"));
        };
        let worst = map.iter().fold(0.0_f64, |a, d| a.max(d.abs()));
        let meaning = format!("real-time mode minus full model, K; rms {rms_k:.4} K");
        Map { plane: map, unit: BrightnessUnit::Kelvin, meaning }.write(args, path, &image, context)?;
        outcome.json["error_rms_k"] = rms_k.into();
        outcome.json["error_max_k"] = worst.into();
        outcome.text += &format!("\nreal-time mode minus full model: {rms_k:.3} K rms");
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

/// One channel over the whole band.
fn mean_band(spectrum: &SpectralWindow) -> Result<SpectralWindow> {
    Ok(SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?)
}

/// A plane beside the image, with the line of history that explains it.
struct Map {
    plane: Array2<f64>,
    unit: BrightnessUnit,
    meaning: String,
}

impl Map {
    /// Write the map on the grid of an image.
    fn write(self, args: &RenderArgs, path: &Path, image: &Image, context: &Context) -> Result<()> {
        let data = self.plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        let mut map = Image::new(image.grid.clone(), mean_band(&image.spectrum)?, vec![Polarization::I], data, self.unit)?;
        map.object.clone_from(&image.object);
        map.history.push(context.history());
        args.write(path, &mut map, self.meaning)
    }
}

/// Distance, angle of incidence and surface numbers, in the order of [`RenderArgs::maps`].
fn maps(picture: Picture) -> [Map; 3] {
    let surfaces = format!("surfaces from 1: {}; 0 is the sky", picture.material_names.join(", "));
    [
        Map { plane: picture.range_m, unit: BrightnessUnit::Metre, meaning: "distance, m; NaN is the sky".into() },
        Map { plane: picture.incidence_deg, unit: BrightnessUnit::Other, meaning: "angle of incidence, deg; NaN is the sky".into() },
        Map { plane: picture.material.mapv(f64::from), unit: BrightnessUnit::One, meaning: surfaces },
    ]
}

/// Note in the history of a pinhole image that its axes are tangents. All other images have direction cosines.
fn note_projection(image: &mut Image, args: &RenderArgs, scene: &SolidScene) {
    if args.scene_cell.is_none() && scene.camera().is_ok_and(|c| c.projection == Projection::Pinhole) {
        image.history.push("pinhole camera: the axes are tangents, not direction cosines".into());
    }
}
