//! `scene`: brightness scenes.

use super::context::{Context, Outcome};
use super::failure::Result;
use super::options::OutputArgs;
use cittert_arrays::quantity::{Angle, Frequency};
use cittert_arrays::{Image, PhaseCenter, SpectralWindow};
use cittert_formats::fits::{ImageOptions, write_image};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// What to do with a scene.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Render a scene description (or read a PNG or FITS scene) into a FITS image in K.
    Render(RenderArgs),
}

/// Options of `scene render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
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
    #[command(flatten)]
    out: OutputArgs,
}

/// Run a subcommand of `scene`.
///
/// # Errors
/// Anything wrong with the scene or the disk.
pub fn run(command: &SceneCommand, context: &Context) -> Result<Outcome> {
    match command {
        SceneCommand::Render(args) => render(args, context),
    }
}

fn render(args: &RenderArgs, context: &Context) -> Result<Outcome> {
    args.out.check(&args.out.output)?;
    let center = match &args.phase_center {
        Some(text) => PhaseCenter::parse(text)?,
        None => PhaseCenter::unprojected("boresight"),
    };
    let spectrum = SpectralWindow::band(args.freq.si(), args.bandwidth.si(), 1)?;
    let scene = super::options::SceneArgs {
        scene: args.scene.clone(),
        scene_cell: args.scene_cell,
        scene_size: args.scene_size,
        scene_min: args.scene_min,
        scene_max: args.scene_max,
    };
    let loaded = scene.load(&center, &spectrum, context)?;
    let Some(mut image) = loaded.sky.images.into_iter().next() else {
        return Err(super::Failure::message(format!("{}: a source list has no pixels to render", args.scene.display())));
    };
    image.history.push(context.history());
    write_image(&args.out.output, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
    Ok(outcome(&image, &loaded.name, args))
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
