//! The options of `film`.

use crate::cli::options::OutputArgs;
use crate::cli::scene::{FlightArgs, Mode};
use crate::display::film::FILMS;
use crate::display::{FilmOptions, RateOptions, ReceiverOptions};
use crate::enhance::StepList;
use clap::Args;
use std::path::PathBuf;

/// Options of `film`.
#[derive(Debug, Args)]
#[command(after_help = films_help())]
pub struct FilmArgs {
    #[command(flatten)]
    pub(super) flight: FlightArgs,
    /// realtime interpolates between rays; full sends a ray through every pixel, and more rays on edges.
    #[arg(long, value_enum, default_value_t = Mode::Realtime)]
    pub(super) mode: Mode,
    #[command(flatten)]
    pub(super) film: FilmOptions,
    #[command(flatten)]
    pub(super) camera: CameraArgs,
    #[command(flatten)]
    pub(super) array: ArrayArgs,
    #[command(flatten)]
    pub(super) rates: RateOptions,
    #[command(flatten)]
    pub(super) out: OutputArgs,
}

/// The filled aperture and what is made of its frames.
#[derive(Debug, Args)]
#[command(next_help_heading = "Filled aperture")]
pub(super) struct CameraArgs {
    /// Sensor with optics, scan and noise: a file of options of the command sensor (TOML). Its frame time is that of the film.
    #[arg(long, value_name = "TOML")]
    pub(super) sensor: Option<PathBuf>,
    #[command(flatten)]
    pub(super) receivers: ReceiverOptions,
    /// Steps of enhancement of each frame, as in enhance: median=3,unsharp=1.5:0.8.
    #[arg(long, value_name = "STEPS", allow_hyphen_values = true)]
    pub(super) steps: Option<StepList>,
    /// PSF that a step of deconvolution needs, a FITS image with the cell of the frames [default: that of the sensor].
    #[arg(long, value_name = "FITS")]
    pub(super) psf: Option<PathBuf>,
    /// Seed of the noise of all panels.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) seed: u64,
}

/// The interferometer.
#[derive(Debug, Args)]
#[command(next_help_heading = "Interferometer")]
pub(super) struct ArrayArgs {
    /// Layout of the interferometer: name of a built-in one that looks along its boresight, or a file.
    #[arg(long, value_name = "NAME|FILE")]
    pub(super) layout: Option<String>,
    /// Number of channels of the interferometer in the bandwidth.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(super) channels: usize,
    /// Let the interferometer measure without noise. It has the system temperature that is given, or that of its layout.
    #[arg(long)]
    pub(super) array_without_noise: bool,
}

impl FilmArgs {
    /// All files that are read, with the one of the scene.
    pub(super) fn inputs<'a>(&'a self, scene: &'a PathBuf) -> impl Iterator<Item = &'a PathBuf> {
        let camera = &self.camera;
        [Some(&self.flight.path), Some(scene), camera.sensor.as_ref(), camera.psf.as_ref()].into_iter().flatten()
    }
}

/// The table of formats, for the help.
fn films_help() -> String {
    let name = |endings: &[&str]| endings.iter().map(|e| format!(".{e}")).collect::<Vec<_>>().join(", ");
    let needs = |needs: Option<&str>| needs.map_or(String::new(), |package| format!(" (needs the package {package})"));
    let lines: Vec<String> =
        FILMS.iter().map(|kind| format!("  {:11} {}: {}{}", name(kind.endings), kind.name, kind.about, needs(kind.needs))).collect();
    format!("Films, by the ending of -o:\n{}", lines.join("\n"))
}
