//! `scene render`: a FITS image in K.

use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result};
use crate::cli::options::{OutputArgs, SceneArgs};
use cittert_arrays::quantity::{Angle, Frequency};
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_phenomenology::trace::RenderOptions;
use cittert_phenomenology::{Scene, View};
use clap::Args;
use ndarray::Axis;
use std::path::PathBuf;

/// Options of `scene render`.
#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Scene description (TOML), PNG or FITS image.
    #[arg(value_name = "SCENE")]
    scene: PathBuf,
    /// Pixels along each side of a scene description.
    #[arg(long, value_name = "N")]
    scene_size: Option<usize>,
    /// Size of a pixel of a PNG or a scene description.
    #[arg(long, value_name = "ANGLE")]
    scene_cell: Option<Angle>,
    /// Temperature of black in a PNG.
    #[arg(long, value_name = "TEMP")]
    scene_min: Option<cittert_arrays::quantity::Temperature>,
    /// Temperature of white in a PNG.
    #[arg(long, value_name = "TEMP")]
    scene_max: Option<cittert_arrays::quantity::Temperature>,
    /// Frequency written into the image.
    #[arg(long, value_name = "FREQ", default_value = "94GHz")]
    freq: Frequency,
    /// Bandwidth written into the image.
    #[arg(long, value_name = "FREQ", default_value = "1GHz")]
    bandwidth: Frequency,
    /// Centre of the image on the sky (default: a boresight).
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    phase_center: Option<String>,
    /// Also write the distance to what each pixel of a scene of solids shows, m.
    #[arg(long, value_name = "FITS")]
    range: Option<PathBuf>,
    /// Also write the angle of incidence there, deg.
    #[arg(long, value_name = "FITS")]
    incidence: Option<PathBuf>,
    /// Also write the number of the surface there (the names stand in the history).
    #[arg(long, value_name = "FITS")]
    material: Option<PathBuf>,
    #[command(flatten)]
    out: OutputArgs,
}

/// Render a scene description, or read a picture, into a FITS image in K.
///
/// # Errors
/// Anything wrong with the scene or the disk.
pub(super) fn run(args: &RenderArgs, context: &Context) -> Result<Outcome> {
    args.out.check(&args.out.output)?;
    maps(args).into_iter().flatten().try_for_each(|path| args.out.check(path))?;
    let center = match &args.phase_center {
        Some(text) => PhaseCenter::parse(text)?,
        None => PhaseCenter::unprojected("boresight"),
    };
    let spectrum = SpectralWindow::band(args.freq.si(), args.bandwidth.si(), 1)?;
    let scene = SceneArgs {
        scene: args.scene.clone(),
        scene_cell: args.scene_cell,
        scene_size: args.scene_size,
        scene_min: args.scene_min,
        scene_max: args.scene_max,
    };
    if maps(args).iter().any(Option::is_some) {
        return with_maps(args, &scene, &spectrum, context);
    }
    let loaded = scene.load(&center, &spectrum, context)?;
    let Some(mut image) = loaded.sky.images.into_iter().next() else {
        return Err(Failure::message(format!("{}: a source list has no pixels to render", args.scene.display())));
    };
    image.history.push(context.history());
    write_image(&args.out.output, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
    Ok(outcome(&image, &loaded.name, args))
}

/// Paths of the maps beside the temperature.
fn maps(args: &RenderArgs) -> [Option<&PathBuf>; 3] {
    [args.range.as_ref(), args.incidence.as_ref(), args.material.as_ref()]
}

/// A scene of solids with the maps that were asked for, on the same grid.
fn with_maps(args: &RenderArgs, scene: &SceneArgs, spectrum: &SpectralWindow, context: &Context) -> Result<Outcome> {
    let text = std::fs::read_to_string(&args.scene)
        .map_err(|e| Failure::message(format!("{}: cannot read the scene: {e}", args.scene.display())))?;
    let named = || args.scene.display().to_string();
    let Scene::Solids(solids) = Scene::from_toml(&text).context(named())? else {
        return Err(Failure::usage(format!("{}: only a scene of solids has range, incidence and material maps", args.scene.display())));
    };
    let view = match (scene.scene_size, scene.scene_cell) {
        (Some(size), Some(cell)) => {
            View::on_grid(solids.camera()?, &SkyGrid::new(size, size, cell.si(), SkyFrame::Boresight)?).context(named())?
        }
        _ => View::of_camera(solids.camera()?).context(named())?,
    };
    let picture = solids.picture(&view, spectrum, &RenderOptions::default()).context(named())?;
    let options = ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() };
    let mut image = picture.temperature;
    image.history.push(context.history());
    write_image(&args.out.output, &image, options)?;
    let mut outcome = outcome(&image, solids.name(), args);
    let planes = [
        (picture.range_m, BrightnessUnit::Metre, String::from("distance, m; NaN is the sky")),
        (picture.incidence_deg, BrightnessUnit::Other, "angle of incidence, deg; NaN is the sky".into()),
        (
            picture.material.mapv(f64::from),
            BrightnessUnit::One,
            format!("surfaces from 1: {}; 0 is the sky", picture.material_names.join(", ")),
        ),
    ];
    for (path, (plane, unit, what)) in maps(args).into_iter().zip(planes) {
        let Some(path) = path else { continue };
        let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
        let band = SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?;
        let mut map = Image::new(image.grid.clone(), band, vec![Polarization::I], data, unit)?;
        map.object.clone_from(&image.object);
        map.history = vec![context.history(), what];
        write_image(path, &map, options)?;
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

fn outcome(image: &Image, name: &str, args: &RenderArgs) -> Outcome {
    let (mut min, mut max, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for t in &image.data {
        min = min.min(*t);
        max = max.max(*t);
        sum += t;
    }
    let mean = sum / image.data.len() as f64;
    let json = serde_json::json!({
        "output": args.out.output, "name": name, "size": [image.grid.n_l, image.grid.n_m], "cell_rad": image.grid.cell_rad,
        "unit": image.unit.bunit(), "min": min, "max": max, "mean": mean,
    });
    let text = format!(
        "{}: {} x {} pixels of {}, {min:.2} to {max:.2} {}, mean {mean:.2}",
        args.out.output.display(),
        image.grid.n_l,
        image.grid.n_m,
        Angle(image.grid.cell_rad),
        image.unit.bunit()
    );
    Outcome::new(json, text).wrote(&args.out.output)
}
