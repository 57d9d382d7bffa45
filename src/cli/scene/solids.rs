//! `scene render` of a scene of solids: the full model with its maps, or the real-time mode with its error.

use super::render::{Mode, RenderArgs, outcome};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result};
use crate::progress::{Event, Observer};
use cittert_arrays::quantity::Temperature;
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyGrid, SpectralWindow};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_phenomenology::camera::Projection;
use cittert_phenomenology::trace::{Frame, MeshOptions, Picture, error_map};
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use clap::Args;
use ndarray::{Array2, Axis};
use std::time::Instant;

/// The mesh of the real-time mode.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct MeshArgs {
    /// Real-time mode: side of the largest squares of the mesh, pixels (1, 2, 4, 8, 16 or 32).
    #[arg(long, value_name = "N", default_value_t = 4)]
    step: usize,
    /// Real-time mode: spread of the corners of a square above which it is split.
    #[arg(long, value_name = "TEMP", default_value = "6K")]
    spread: Temperature,
}

impl MeshArgs {
    /// As options of a frame.
    pub(super) fn options(self, antialias: bool) -> MeshOptions {
        MeshOptions { step: self.step, spread_k: self.spread.si(), antialias, ..MeshOptions::default() }
    }
}

/// Renders a scene of solids.
///
/// # Errors
/// Options that exclude each other, a scene that cannot be rendered, or what the disk says.
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
    image.history.push(context.history());
    write(args, &args.out.output, &image)?;
    let mut outcome = outcome(&image, scene.name(), args);
    outcome.json["rays"] = picture.rays.into();
    for (path, (plane, unit, what)) in args.maps().into_iter().zip(planes(picture)) {
        let Some(path) = path else { continue };
        let mut map = plane_image(&image, plane, unit)?;
        map.history = vec![context.history(), what];
        write(args, path, &map)?;
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

/// Direction cosines of the asked cell, or the camera's own projection with its own or the asked number of pixels.
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

/// One frame of the real-time mode; its error if asked for.
fn realtime(
    args: &RenderArgs,
    scene: &SolidScene,
    view: &View,
    spectrum: &SpectralWindow,
    options: &RenderOptions,
    context: &Context,
) -> Result<Outcome> {
    if options.polarizations.len() != 1 || options.per_channel || args.maps().iter().any(Option::is_some) {
        return Err(Failure::usage("--mode realtime makes one plane: give one --pol, one channel, and ask --mode full for maps"));
    }
    let named = || args.scene.display().to_string();
    let tracer = Tracer::new(scene, &[spectrum.mean_hz()], options).context(named())?;
    let mesh = args.mesh.options(options.antialias > 1);
    let started = Instant::now();
    let frame = tracer.frame(view, &mesh).context(named())?;
    let seconds = started.elapsed().as_secs_f64();
    let band = SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?;
    let mut image = frame_image(&frame, view, &band, options.polarizations[0])?;
    image.object = scene.name().to_owned();
    note_projection(&mut image, args, scene);
    image.history.push(context.history());
    write(args, &args.out.output, &image)?;
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
        let mut map = plane_image(&image, map, BrightnessUnit::Kelvin)?;
        map.history = vec![context.history(), format!("real-time mode minus full model, K; rms {rms_k:.4} K")];
        write(args, path, &map)?;
        outcome.json["error_rms_k"] = rms_k.into();
        outcome.json["error_max_k"] = worst.into();
        outcome.text += &format!("\nreal-time mode minus full model: {rms_k:.3} K rms");
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

fn frame_image(frame: &Frame, view: &View, band: &SpectralWindow, pol: Polarization) -> Result<Image> {
    let data = frame.temperature_k.clone().insert_axis(Axis(0)).insert_axis(Axis(0));
    Ok(Image::new(view.grid().clone(), band.clone(), vec![pol], data, BrightnessUnit::Kelvin)?)
}

fn planes(picture: Picture) -> [(Array2<f64>, BrightnessUnit, String); 3] {
    [
        (picture.range_m, BrightnessUnit::Metre, "distance, m; NaN is the sky".into()),
        (picture.incidence_deg, BrightnessUnit::Other, "angle of incidence, deg; NaN is the sky".into()),
        (
            picture.material.mapv(f64::from),
            BrightnessUnit::One,
            format!("surfaces from 1: {}; 0 is the sky", picture.material_names.join(", ")),
        ),
    ]
}

/// A plane on the grid of an image.
fn plane_image(image: &Image, plane: Array2<f64>, unit: BrightnessUnit) -> Result<Image> {
    let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
    let band = SpectralWindow::new(vec![image.spectrum.mean_hz()], vec![image.spectrum.extent_hz()])?;
    let mut map = Image::new(image.grid.clone(), band, vec![Polarization::I], data, unit)?;
    map.object.clone_from(&image.object);
    Ok(map)
}

/// An image of tangents says so; all others are direction cosines.
fn note_projection(image: &mut Image, args: &RenderArgs, scene: &SolidScene) {
    if args.scene_cell.is_none() && scene.camera().is_ok_and(|c| c.projection == Projection::Pinhole) {
        image.history.push("pinhole camera: the axes are tangents, not direction cosines".into());
    }
}

fn write(args: &RenderArgs, path: &std::path::Path, image: &Image) -> Result<()> {
    write_image(path, image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
    Ok(())
}
