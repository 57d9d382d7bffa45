//! `scene render` for scenes of solids: the full model with its maps, or the real-time mode with its error.

use super::image::{Mode, RenderArgs, outcome};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::plot::{self, ImagePlot, cause_picture, scene_picture};
use crate::progress::{Event, Observer};
use cittert_arrays::quantity::Frequency;
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyGrid, SpectralWindow};
use cittert_phenomenology::camera::Projection;
use cittert_phenomenology::trace::{Picture, error_map};
use cittert_phenomenology::{RenderOptions, SolidScene, Tracer, View};
use ndarray::{Array2, Array4, Axis};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A scene of solids, ready to be rendered.
struct Job<'a> {
    args: &'a RenderArgs,
    scene: SolidScene,
    view: View,
    options: RenderOptions,
    context: &'a Context,
}

/// Render a scene of solids.
///
/// # Errors
/// Options that exclude each other, a scene that cannot be rendered, or an error of the file system.
pub(super) fn run(
    args: &RenderArgs,
    scene: SolidScene,
    (center, spectrum): (&PhaseCenter, &SpectralWindow),
    context: &Context,
) -> Result<Outcome> {
    let named = args.scene.display();
    let scene = args.tracer.scene(scene).context(&named)?;
    let view = view(args, &scene, center).context(&named)?;
    let options = RenderOptions { causes: args.causes.is_some(), ..args.tracer.options(spectrum.n_chan() > 1) };
    let job = Job { args, scene, view, options, context };
    job.tell_extended(spectrum);
    if args.mode == Mode::Realtime {
        return job.realtime(spectrum);
    }
    check_full(args)?;
    let picture = job.full(spectrum).context(&named)?;
    let mut image = picture.temperature.clone();
    let mut outcome = job.write(&mut image)?;
    outcome.json["rays"] = picture.rays.into();
    outcome = job.draw(&picture, outcome)?;
    for (path, map) in args.maps().into_iter().zip(maps(picture)).filter_map(|(path, map)| Some((path?, map))) {
        outcome = job.map(path, map, &image, outcome)?;
    }
    match args.model_error_files() {
        Some(files) => job.model_error(files, spectrum, &image, outcome),
        None => Ok(outcome),
    }
}

/// Refuse what only the real-time mode has.
///
/// # Errors
/// Such an option.
pub(super) fn check_full(args: &RenderArgs) -> Result<()> {
    let only = "--error-map compares the real-time mode with the full model; give it with --mode realtime";
    ensure!(args.error_map.is_none(), Failure::usage(only));
    Ok(())
}

/// Refuse what only the full model has.
///
/// # Errors
/// Such an option.
pub(super) fn check_realtime(args: &RenderArgs, options: &RenderOptions) -> Result<()> {
    let one = options.polarizations.len() == 1 && !options.per_channel && !args.asks_maps() && args.model_error.is_none();
    let only = "--mode realtime renders one plane: give one --pol and one channel, and use --mode full for maps and drawings";
    ensure!(one, Failure::usage(only));
    Ok(())
}

/// The view on a grid of direction cosines where a cell is given, otherwise in the projection of the camera.
///
/// # Errors
/// A cell without a size, or a scene without a camera.
pub(super) fn view(args: &RenderArgs, scene: &SolidScene, center: &PhaseCenter) -> Result<View> {
    let camera = scene.camera()?;
    Ok(match (args.scene_size, args.scene_cell) {
        (Some(size), Some(cell)) => View::on_grid(camera, &SkyGrid::new(size, size, cell.si(), SkyGrid::frame_of(center))?)?,
        (Some(size), None) => View::of_camera(&camera.with_side(size))?,
        (None, None) => View::of_camera(camera)?,
        (None, Some(_)) => return Err(Failure::usage("--scene-cell needs --scene-size")),
    })
}

impl Job<'_> {
    /// The image of the full model, with its maps.
    fn full(&self, spectrum: &SpectralWindow) -> Result<Picture> {
        let passes = if self.options.antialias > 1 { 2 } else { 1 };
        let rows = (passes * self.view.grid().n_m) as u64;
        self.context.console.event(Event::Phase { name: "tracing", total: Some(rows), unit: "rows" });
        let tell = |_: usize, _: usize| self.context.console.event(Event::Advance(1));
        let picture = self.scene.picture_observed(&self.view, spectrum, &self.options, Some(&tell));
        self.context.console.event(Event::Done);
        Ok(picture?)
    }

    /// Write the temperatures, and describe them.
    fn write(&self, image: &mut Image) -> Result<Outcome> {
        // All images but those of a pinhole camera have direction cosines.
        if self.args.scene_cell.is_none() && self.scene.camera().is_ok_and(|c| c.projection == Projection::Pinhole) {
            image.history.push("pinhole camera: the axes are tangents, not direction cosines".into());
        }
        self.args.out.image(&self.args.out.output, image, self.context)?;
        Ok(outcome(image, self.scene.name(), self.args))
    }

    /// Draw the temperatures of the first plane and channel, and what they come from.
    fn draw(&self, picture: &Picture, mut outcome: Outcome) -> Result<Outcome> {
        if let Some(path) = &self.args.picture {
            let on_surface = picture.material.mapv(|m| m > 0);
            let png = scene_picture(picture.temperature.plane(0, 0), on_surface.view(), self.args.stretch.stretch())?;
            self.args.out.write(path, &png)?;
            outcome = outcome.wrote(path);
        }
        if let (Some(path), Some(causes)) = (&self.args.causes, &picture.causes_k) {
            self.args.out.write(path, &cause_picture(causes.view())?)?;
            outcome = outcome.wrote(path);
        }
        Ok(outcome)
    }

    /// Write a map on the grid of an image.
    fn map(&self, path: &Path, map: Map, image: &Image, outcome: Outcome) -> Result<Outcome> {
        let mut out = Image::new(image.grid.clone(), mean_band(&image.spectrum)?, vec![Polarization::I], map.cube(), map.unit)?;
        out.object.clone_from(&image.object);
        out.history.push(map.meaning);
        self.args.out.image(path, &mut out, self.context)?;
        Ok(outcome.wrote(path))
    }

    /// Name the materials that are used outside the range of their models.
    fn tell_extended(&self, spectrum: &SpectralWindow) {
        for e in self.scene.extended(spectrum.mean_hz()) {
            let more = if self.args.model_error.is_some() { "" } else { "; --model-error maps what this does to the picture" };
            let (percent, freq) = (100.0 * e.uncertainty, Frequency(spectrum.mean_hz()));
            self.context.console.note(&format!(
                "{} is used at {freq}, outside the range of its model {}: its permittivity is uncertain by {percent:.1} %{more}",
                e.material, e.model
            ));
        }
    }

    /// Write the map of the error of the models and its picture, and say what each material adds.
    fn model_error(&self, [map, png]: [PathBuf; 2], spectrum: &SpectralWindow, image: &Image, mut outcome: Outcome) -> Result<Outcome> {
        let error = self.scene.model_error(&self.view, spectrum, &self.options).context(self.args.scene.display())?;
        let rms_k = (error.map_k.iter().map(|e| e * e).sum::<f64>() / error.map_k.len() as f64).sqrt();
        outcome.json["model_error_rms_k"] = rms_k.into();
        outcome.json["model_error_max_k"] = error.map_k.iter().copied().fold(0.0, f64::max).into();
        let parts = error.parts.iter().map(|(e, rms_k, max_k)| {
            json!({ "material": e.material, "model": e.model, "uncertainty": e.uncertainty, "rms_k": rms_k, "max_k": max_k })
        });
        outcome.json["model_error"] = parts.collect();
        outcome.text += &format!("\nmodels outside of their range: {rms_k:.3} K rms");
        for (e, rms_k, max_k) in &error.parts {
            outcome.text += &format!("\n  {} ({}): {rms_k:.3} K rms, {max_k:.2} K at most", e.material, e.model);
        }
        let meaning = format!("standard error by models of permittivity outside of their range, K; rms {rms_k:.4} K");
        let plane = Map { plane: error.map_k, unit: BrightnessUnit::Kelvin, meaning };
        let title = format!("{}: standard error by models outside of their range", self.scene.name());
        let mut drawn = Image::new(image.grid.clone(), mean_band(&image.spectrum)?, vec![Polarization::I], plane.cube(), plane.unit)?;
        drawn.object.clone_from(&image.object);
        self.args.out.write(&png, &plot::image(&drawn, &ImagePlot { title, ..ImagePlot::default() })?.png()?)?;
        Ok(self.map(&map, plane, image, outcome)?.wrote(png))
    }

    /// Render one frame in the real-time mode, with its error map if the options select one.
    fn realtime(&self, spectrum: &SpectralWindow) -> Result<Outcome> {
        let (args, options, named) = (self.args, &self.options, self.args.scene.display());
        check_realtime(args, options)?;
        let tracer = Tracer::new(&self.scene, &[spectrum.mean_hz()], options).context(&named)?;
        let started = Instant::now();
        let frame = tracer.frame(&self.view, &args.mesh.options(options.antialias > 1)).context(&named)?;
        let seconds = started.elapsed().as_secs_f64();
        let band = mean_band(spectrum)?;
        let data = frame.temperature_k.clone().insert_axis(Axis(0)).insert_axis(Axis(0));
        let grid = self.view.grid().clone();
        let mut image = Image::new(grid, band.clone(), options.polarizations.clone(), data, BrightnessUnit::Kelvin)?;
        image.object = self.scene.name().to_owned();
        let mut outcome = self.write(&mut image)?;
        let (rays, pixels, table_error_k) = (frame.rays, image.data.len(), tracer.table_error_k());
        outcome.json["rays"] = rays.into();
        outcome.json["frame_s"] = seconds.into();
        outcome.json["table_error_k"] = table_error_k.into();
        outcome.text += &format!("\n{rays} rays for {pixels} pixels, {:.1} ms, tables within {table_error_k:.4} K", 1e3 * seconds);
        let Some(path) = &args.error_map else { return Ok(outcome) };
        let picture = self.full(&band).context(&named)?;
        let Some((map, rms_k)) = error_map(&frame, picture.temperature.plane(0, 0)) else {
            return Err(Failure::message("the frame and the full model have different sizes"));
        };
        outcome.json["error_rms_k"] = rms_k.into();
        outcome.json["error_max_k"] = map.iter().fold(0.0_f64, |a, d| a.max(d.abs())).into();
        outcome.text += &format!("\nreal-time mode minus full model: {rms_k:.3} K rms");
        let meaning = format!("real-time mode minus full model, K; rms {rms_k:.4} K");
        self.map(path, Map { plane: map, unit: BrightnessUnit::Kelvin, meaning }, &image, outcome)
    }
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
    /// The plane as the only one of an image \[chan, pol, m, l\].
    fn cube(&self) -> Array4<f64> {
        self.plane.clone().insert_axis(Axis(0)).insert_axis(Axis(0))
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
