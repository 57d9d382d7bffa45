//! The options of `scene render`, and the image that it writes and describes.

use crate::cli::context::{Context, Outcome};
use crate::cli::options::{OutputArgs, TracerArgs};
use crate::plot::SceneStretch;
use cittert_arrays::Image;
use cittert_arrays::quantity::{Angle, Frequency, Temperature};
use cittert_phenomenology::trace::MeshOptions;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// The mesh of the real-time mode.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct MeshArgs {
    /// Real-time mode: side of the largest squares of the mesh, pixels (1, 2, 4, 8, 16 or 32).
    #[arg(long, value_name = "N", default_value_t = MeshOptions::default().step)]
    step: usize,
    /// Real-time mode: a square whose corners differ by more than this is split.
    #[arg(long, value_name = "TEMP", default_value = "6K")]
    spread: Temperature,
}

impl MeshArgs {
    /// The options of a frame.
    pub(super) fn options(self, antialias: bool) -> MeshOptions {
        MeshOptions { step: self.step, spread_k: self.spread.si(), antialias, ..MeshOptions::default() }
    }
}

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
    pub(super) scene_min: Option<Temperature>,
    /// Temperature of white in a PNG.
    #[arg(long, value_name = "TEMP")]
    pub(super) scene_max: Option<Temperature>,
    /// Centre of the band [default: the frequency that the scene states, or 94GHz].
    #[arg(long, value_name = "FREQ")]
    pub(super) freq: Option<Frequency>,
    /// Width of the band.
    #[arg(long, value_name = "FREQ", default_value = "1GHz")]
    pub(super) bandwidth: Frequency,
    /// Number of channels, each rendered at its own frequency (scenes of solids).
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) channels: usize,
    /// Centre of the image on the sky [default: none, the image is around a boresight].
    #[arg(long, value_name = "RA,DEC", allow_hyphen_values = true)]
    pub(super) phase_center: Option<String>,
    /// full sends a ray through every pixel, and more rays on edges; realtime interpolates between fewer rays.
    #[arg(long, value_enum, default_value_t = Mode::Full)]
    pub(super) mode: Mode,
    #[command(flatten)]
    pub(super) tracer: TracerArgs,
    #[command(flatten)]
    pub(super) mesh: MeshArgs,
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
    /// Also write the standard error that models of permittivity outside of their range bring, K, and a picture of it beside (.png).
    #[arg(long, value_name = "FITS")]
    pub(super) model_error: Option<PathBuf>,
    /// Also draw the temperatures of a scene of solids into this PNG file, one pixel each.
    #[arg(long, value_name = "PNG")]
    pub(super) picture: Option<PathBuf>,
    /// How --picture turns temperatures into grey. The levels follow from the pixels that show surfaces, not from the sky.
    #[arg(long, value_enum, default_value_t = StretchName::Asinh)]
    pub(super) stretch: StretchName,
    /// Also draw what the temperatures come from into this PNG file: red for the emission of the surface in view, green for what it mirrors
    /// of other surfaces and the ground, blue for sky, air and weather.
    #[arg(long, value_name = "PNG")]
    pub(super) causes: Option<PathBuf>,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// How a scene of solids is rendered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(in crate::cli) enum Mode {
    /// The full model.
    Full,
    /// The real-time mode, which interpolates on a mesh.
    Realtime,
}

/// How temperatures become grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub(super) enum StretchName {
    /// Fine steps around the median of the surfaces, coarse ones far from it.
    Asinh,
    /// In proportion, from the 1st to the 99th percentile of the surfaces.
    Linear,
    /// Equal numbers of pixels for each level.
    Rank,
}

impl StretchName {
    /// The stretch of this name.
    pub(super) fn stretch(self) -> SceneStretch {
        match self {
            Self::Asinh => SceneStretch::Asinh,
            Self::Linear => SceneStretch::Linear,
            Self::Rank => SceneStretch::Rank,
        }
    }
}

/// The frequency of a scene that states none, Hz.
const USUAL_FREQ_HZ: f64 = 94e9;

/// The frequency of a rendering: the one that is given, or the one that the scene states, or 94 GHz. Only a departure from the scene, and a
/// frequency that nobody gave, are told.
pub(super) fn frequency(given: Option<Frequency>, stated_hz: Option<f64>, context: &Context) -> Frequency {
    match (given, stated_hz) {
        (Some(given), Some(stated)) if given.si() != stated => {
            context.console.note(&format!("the scene is described for {}, and rendered at {given}", Frequency(stated)));
            given
        }
        (Some(given), _) => given,
        (None, Some(stated)) => Frequency(stated),
        (None, None) => {
            context.console.note(&format!("the scene states no frequency: {} is taken", Frequency(USUAL_FREQ_HZ)));
            Frequency(USUAL_FREQ_HZ)
        }
    }
}

impl RenderArgs {
    /// Paths of the maps beside the temperature.
    pub(super) fn maps(&self) -> [Option<&PathBuf>; 3] {
        [self.range.as_ref(), self.incidence.as_ref(), self.material.as_ref()]
    }

    /// The map of the error of the models, and its picture.
    pub(super) fn model_error_files(&self) -> Option<[PathBuf; 2]> {
        self.model_error.as_ref().map(|path| [path.clone(), path.with_extension("png")])
    }

    /// Paths of the drawings beside the temperature.
    pub(super) fn drawings(&self) -> [Option<&PathBuf>; 2] {
        [self.picture.as_ref(), self.causes.as_ref()]
    }

    /// Whether a map or a drawing is asked for, which only the full model has.
    pub(super) fn asks_maps(&self) -> bool {
        self.maps().iter().chain(&self.drawings()).any(Option::is_some)
    }

    /// Whether an option needs the ray tracer.
    pub(super) fn asks_tracer(&self) -> bool {
        self.mode == Mode::Realtime || self.error_map.is_some() || self.model_error.is_some() || self.channels != 1 || self.asks_maps()
    }
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
