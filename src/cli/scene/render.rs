//! `scene render`: render a scene into a FITS image in K.

use super::solids;
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::cli::options::{OutputArgs, SceneArgs, TracerArgs, read_scene};
use cittert_arrays::quantity::{Angle, Frequency, Temperature};
use cittert_arrays::{Image, PhaseCenter, SpectralWindow};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_phenomenology::Scene;
use clap::{Args, ValueEnum};
use std::path::{Path, PathBuf};

/// Options of `scene render`.
#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Scene description (TOML), PNG or FITS image.
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Pixels along each side of a rendered scene. Without --scene-cell they cover the field of view of its camera.
    #[arg(long, value_name = "N")]
    pub(super) scene_size: Option<usize>,
    /// Size of a pixel of a PNG or of a rendered scene.
    #[arg(long, value_name = "ANGLE")]
    pub(super) scene_cell: Option<Angle>,
    /// Temperature of black in a PNG.
    #[arg(long, value_name = "TEMP")]
    scene_min: Option<Temperature>,
    /// Temperature of white in a PNG.
    #[arg(long, value_name = "TEMP")]
    scene_max: Option<Temperature>,
    /// Centre of the band.
    #[arg(long, value_name = "FREQ", default_value = "94GHz")]
    freq: Frequency,
    /// Width of the band.
    #[arg(long, value_name = "FREQ", default_value = "1GHz")]
    bandwidth: Frequency,
    /// Number of channels, each rendered at its own frequency (scenes of solids).
    #[arg(long, value_name = "N", default_value_t = 1)]
    channels: usize,
    /// Centre of the image on the sky [default: none, the image is around a boresight].
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    phase_center: Option<String>,
    /// full sends a ray through every pixel, and more rays on edges; realtime interpolates between fewer rays.
    #[arg(long, value_enum, default_value_t = Mode::Full)]
    pub(super) mode: Mode,
    #[command(flatten)]
    pub(super) tracer: TracerArgs,
    #[command(flatten)]
    pub(super) mesh: solids::MeshArgs,
    /// With --mode realtime: also write the difference from the full model, K, and print its rms.
    #[arg(long, value_name = "FITS")]
    pub(super) error_map: Option<PathBuf>,
    /// Also write the distance to the surface in each pixel of a scene of solids, m.
    #[arg(long, value_name = "FITS")]
    pub(super) range: Option<PathBuf>,
    /// Also write the angle of incidence on that surface, deg.
    #[arg(long, value_name = "FITS")]
    pub(super) incidence: Option<PathBuf>,
    /// Also write the number of that surface; the history of the file lists the names.
    #[arg(long, value_name = "FITS")]
    pub(super) material: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// How a scene of solids is rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// The full model.
    Full,
    /// The real-time mode, which interpolates on a mesh.
    Realtime,
}

impl RenderArgs {
    /// Paths of the maps beside the temperature.
    pub(super) fn maps(&self) -> [Option<&PathBuf>; 3] {
        [self.range.as_ref(), self.incidence.as_ref(), self.material.as_ref()]
    }

    /// Write an image or a map with a last line of history.
    pub(super) fn write(&self, path: &Path, image: &mut Image, history: String) -> Result<()> {
        image.history.push(history);
        Ok(write_image(path, image, ImageOptions { overwrite: self.out.overwrite, ..ImageOptions::default() })?)
    }

    /// Whether an option needs the ray tracer.
    fn asks_tracer(&self) -> bool {
        self.mode == Mode::Realtime || self.error_map.is_some() || self.channels != 1 || self.maps().iter().any(Option::is_some)
    }
}

/// Render a scene description, or read a picture, into a FITS image in K.
///
/// # Errors
/// A scene that is wrong, or an error of the file system.
pub(super) fn run(args: &RenderArgs, context: &Context) -> Result<Outcome> {
    args.out.check(&args.out.output)?;
    args.maps().into_iter().flatten().chain(&args.error_map).try_for_each(|path| args.out.check(path))?;
    let center = match &args.phase_center {
        Some(text) => PhaseCenter::parse(text)?,
        None => PhaseCenter::unprojected("boresight"),
    };
    let spectrum = SpectralWindow::band(args.freq.si(), args.bandwidth.si(), args.channels)?;
    if args.scene.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"))
        && let Scene::Solids(scene) = read_scene(&args.scene)?
    {
        return solids::run(args, *scene, &center, &spectrum, context);
    }
    if args.asks_tracer() {
        return Err(Failure::usage(format!(
            "{}: only a scene of solids has maps, rendered channels and a real-time mode",
            args.scene.display()
        )));
    }
    let scene = SceneArgs {
        scene: args.scene.clone(),
        scene_cell: args.scene_cell,
        scene_size: args.scene_size,
        scene_channels: false,
        scene_min: args.scene_min,
        scene_max: args.scene_max,
    };
    let loaded = scene.load(&center, &spectrum, context)?;
    let Some(mut image) = loaded.sky.images.into_iter().next() else {
        return Err(Failure::message(format!("{}: a source list has no pixels to render", args.scene.display())));
    };
    args.write(&args.out.output, &mut image, context.history())?;
    Ok(outcome(&image, &loaded.name, args))
}

/// The summary of an image, as text and JSON.
pub(super) fn outcome(image: &Image, name: &str, args: &RenderArgs) -> Outcome {
    let (min, max) = image.data.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(lo, hi), t| (lo.min(*t), hi.max(*t)));
    let mean = image.data.iter().sum::<f64>() / image.data.len() as f64;
    let pols: Vec<String> = image.polarizations.iter().map(ToString::to_string).collect();
    let json = serde_json::json!({
        "output": args.out.output, "name": name, "size": [image.grid.n_l, image.grid.n_m], "cell_rad": image.grid.cell_rad,
        "unit": image.unit.bunit(), "min": min, "max": max, "mean": mean,
        "n_freqs": image.spectrum.n_chan(), "polarizations": pols,
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
