//! `scene render`: a FITS image in K.

use super::solids;
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::cli::options::{OutputArgs, SceneArgs, TracerArgs, read_scene};
use cittert_arrays::quantity::{Angle, Frequency, Temperature};
use cittert_arrays::{Image, PhaseCenter, SpectralWindow};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_phenomenology::Scene;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// Options of `scene render`.
#[derive(Debug, Args)]
pub(crate) struct RenderArgs {
    /// Scene description (TOML), PNG or FITS image.
    #[arg(value_name = "SCENE")]
    pub(super) scene: PathBuf,
    /// Pixels along each side of a scene description; without --scene-cell over the field of view of its camera.
    #[arg(long, value_name = "N")]
    pub(super) scene_size: Option<usize>,
    /// Size of a pixel of a PNG or a scene description.
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
    /// Channels with temperatures of their own (scenes of solids).
    #[arg(long, value_name = "N", default_value_t = 1)]
    channels: usize,
    /// Centre of the image on the sky (default: a boresight).
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    phase_center: Option<String>,
    /// full follows a ray for every pixel and more on edges; realtime interpolates between them.
    #[arg(long, value_enum, default_value_t = Mode::Full)]
    pub(super) mode: Mode,
    #[command(flatten)]
    pub(super) tracer: TracerArgs,
    #[command(flatten)]
    pub(super) mesh: solids::MeshArgs,
    /// With --mode realtime: also the difference to the full model, K; its rms is told.
    #[arg(long, value_name = "FITS")]
    pub(super) error_map: Option<PathBuf>,
    /// Also write the distance to what each pixel of a scene of solids shows, m.
    #[arg(long, value_name = "FITS")]
    pub(super) range: Option<PathBuf>,
    /// Also write the angle of incidence there, deg.
    #[arg(long, value_name = "FITS")]
    pub(super) incidence: Option<PathBuf>,
    /// Also write the number of the surface there (the names stand in the history).
    #[arg(long, value_name = "FITS")]
    pub(super) material: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// How a picture is made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// The full model.
    Full,
    /// The mesh of the real-time mode.
    Realtime,
}

impl RenderArgs {
    /// Paths of the maps beside the temperature.
    pub(super) fn maps(&self) -> [Option<&PathBuf>; 3] {
        [self.range.as_ref(), self.incidence.as_ref(), self.material.as_ref()]
    }

    /// Whether something is asked for that only the tracer has.
    fn asks_tracer(&self) -> bool {
        self.mode == Mode::Realtime || self.error_map.is_some() || self.channels != 1 || self.maps().iter().any(Option::is_some)
    }
}

/// Render a scene description, or read a picture, into a FITS image in K.
///
/// # Errors
/// Anything wrong with the scene or the disk.
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
            "{}: only a scene of solids has maps, channels of its own and a real-time mode",
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
    image.history.push(context.history());
    write_image(&args.out.output, &image, ImageOptions { overwrite: args.out.overwrite, ..ImageOptions::default() })?;
    Ok(outcome(&image, &loaded.name, args))
}

/// What is told of an image.
pub(super) fn outcome(image: &Image, name: &str, args: &RenderArgs) -> Outcome {
    let (mut min, mut max, mut sum) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
    for t in &image.data {
        min = min.min(*t);
        max = max.max(*t);
        sum += t;
    }
    let mean = sum / image.data.len() as f64;
    let pols: Vec<String> = image.polarizations.iter().map(ToString::to_string).collect();
    let json = serde_json::json!({
        "output": args.out.output, "name": name, "size": [image.grid.n_l, image.grid.n_m], "cell_rad": image.grid.cell_rad,
        "unit": image.unit.bunit(), "min": min, "max": max, "mean": mean,
        "n_freqs": image.spectrum.n_chan(), "polarizations": pols,
    });
    let text = format!(
        "{}: {} x {} pixels of {:.9}, {min:.2} to {max:.2} {}, mean {mean:.2}",
        args.out.output.display(),
        image.grid.n_l,
        image.grid.n_m,
        Angle(image.grid.cell_rad),
        image.unit.bunit()
    );
    Outcome::new(json, text).wrote(&args.out.output)
}
