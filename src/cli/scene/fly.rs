//! `scene fly`: frames of a moving camera in the real-time mode, and a film of them.

use super::flight::{FlightArgs, Flown};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Failure, Result};
use crate::cli::forecast::{Plan, Planner, Scratch, Told, frames_to_make, measured};
use crate::cli::options::OutputArgs;
use crate::cost::{self, Filmed};
use crate::display::Stages;
use crate::progress::{Observer, Silent};
use crate::{ChainError, plot};
use cittert_arrays::quantity::Temperature;
use cittert_formats::atomic::{AtomicDir, Replaces};
use cittert_phenomenology::Tracer;
use cittert_phenomenology::camera::Camera;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Options of `scene fly`.
#[derive(Debug, Args)]
pub(crate) struct FlyArgs {
    #[command(flatten)]
    flight: FlightArgs,
    /// Temperature that is drawn black [default: the 0.5th percentile of the first frame].
    #[arg(long, value_name = "TEMP")]
    black: Option<Temperature>,
    /// Temperature that is drawn white [default: the 99.5th percentile of the first frame].
    #[arg(long, value_name = "TEMP")]
    white: Option<Temperature>,
    /// Write no film, even where ffmpeg is installed.
    #[arg(long)]
    no_video: bool,
    /// Folder for the frames and the film.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace a folder that exists.
    #[arg(long)]
    overwrite: bool,
}

/// Name of the film in the folder.
const FILM: &str = "flight.mp4";
/// Name of the file of numbers in the folder.
const NUMBERS: &str = "flight.json";

/// Render the frames along a path: frame-00000.png and so on, flight.mp4, and flight.json with the numbers.
///
/// # Errors
/// A path or scene that is wrong, a camera inside a solid, or an error of the file system.
pub(super) fn run(args: &FlyArgs, context: &Context) -> Result<Outcome> {
    let (path_file, (flight, path)) = (&args.flight.path, args.flight.read("scene fly")?);
    OutputArgs { output: args.output.clone(), overwrite: args.overwrite }.claim([&args.output], [path_file, &path])?;
    let flown = args.flight.open(flight, &path, false, context)?;
    let cameras = flown.cameras()?;
    let folder = AtomicDir::create(&args.output, args.overwrite, Replaces::FilesOf("cittert scene fly"))?;
    let (tracer, base, flight) = (flown.tracer()?, &flown.base, &flown.flight);
    let Shot { grey, rays, seconds } = shoot(args, (&flown, &tracer), &cameras, (folder.path(), &context.console))?;
    let film = !args.no_video
        && match film(folder.path(), flight.frames_per_second) {
            Ok(()) => true,
            Err(NoFilm::Failed(why)) => {
                context.console.warn(&format!("no film: ffmpeg failed: {why}"));
                false
            }
            Err(NoFilm::Missing) => {
                context.console.note("no film: ffmpeg is not installed; the frames are written");
                false
            }
        };
    let rate = cameras.len() as f64 / seconds;
    let json = json!({
        "output": args.output, "frames": cameras.len(), "frames_per_second": rate, "seconds": seconds, "rays": rays,
        "size": base.size_px, "black_k": grey.black_k, "white_k": grey.white_k, "video": film.then(|| args.output.join(FILM)),
        "history": context.history(),
    });
    std::fs::write(folder.path().join(NUMBERS), serde_json::to_vec_pretty(&json)?)?;
    folder.commit()?;
    let mut text = format!(
        "{}: {} frames of {} x {} pixels, {rate:.1} frames a second",
        args.output.display(),
        cameras.len(),
        base.size_px[0],
        base.size_px[1]
    );
    if film {
        text += &format!("\n{}", args.output.join(FILM).display());
    }
    Ok(Outcome::new(json, text).wrote(&args.output))
}

/// The frames that were made.
struct Shot {
    grey: GreyScale,
    rays: usize,
    /// Time of all of them, s.
    seconds: f64,
}

/// Make a frame for each camera, and write it into the folder.
///
/// # Errors
/// A ray that leaves the tables, or an error of the file system.
fn shoot(
    args: &FlyArgs,
    (flown, tracer): (&Flown, &Tracer<'_>),
    cameras: &[Camera],
    (folder, observer): (&Path, &dyn Observer),
) -> Result<Shot> {
    // A frame has parts that one thread does, so two frames are made at once rather than one by two threads. The first one decides what is black and white.
    let started = Instant::now();
    let frame = |k: usize| {
        flown.frame(tracer, &cameras[k]).map_err(|e| ChainError::Other(format!("{}: frame {k}: {e}", args.flight.path.display()).into()))
    };
    let first = frame(0).map_err(Failure::call)?;
    let grey = GreyScale::new(first.temperature_k.iter().copied().collect(), args)?;
    let (first, mut rays) = (Mutex::new(Some(first)), 0);
    let stages = Stages {
        see: |k: usize| {
            let kept = if k == 0 { first.lock().unwrap_or_else(PoisonError::into_inner).take() } else { None };
            let frame = kept.map_or_else(|| frame(k), Ok)?;
            Ok((plot::grey(frame.temperature_k.view(), grey.black_k, grey.white_k)?, frame.rays))
        },
        measure: |_: usize, (png, of_frame): (Vec<u8>, usize)| {
            rays += of_frame;
            Ok(png)
        },
        show: |_: usize, png: Vec<u8>| Ok(png),
        write: |k: usize, png: Vec<u8>| {
            let path = folder.join(format!("frame-{k:05}.png"));
            std::fs::write(&path, png).map_err(|e| ChainError::Other(format!("{}: {e}", path.display()).into()))
        },
    };
    stages.run(cameras.len(), observer).map_err(Failure::call)?;
    Ok(Shot { grey, rays, seconds: started.elapsed().as_secs_f64() })
}

impl Plan for FlyArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("makes the frames of a flight")?;
        planner.no_visibilities("frames have none")?;
        let scratch = Scratch::new()?;
        let mut counts = (0, 0);
        let done = measured(|| {
            let (flight, path) = self.flight.read("scene fly")?;
            let flown = self.flight.open(flight, &path, false, planner.context)?;
            let all = flown.cameras()?;
            let some = frames_to_make(planner.threads).clamp(1, all.len().max(1));
            let cameras: Vec<Camera> = (0..some).filter_map(|k| all.get(k * all.len() / some).cloned()).collect();
            counts = (all.len(), cameras.len());
            let shot = shoot(self, (&flown, &flown.tracer()?), &cameras, (scratch.path(), &Silent))?;
            let started = Instant::now();
            if !self.no_video {
                // Without ffmpeg there is no film, which takes no time.
                let _ = film(scratch.path(), flown.flight.frames_per_second);
            }
            Ok((shot.seconds, started.elapsed().as_secs_f64()))
        })?;
        let (part, (frames_s, video_s)) = (counts.0 as f64 / counts.1.max(1) as f64, done.result);
        let written = std::fs::read_dir(scratch.path())?.filter_map(|file| Some(file.ok()?.metadata().ok()?.len() as f64)).sum::<f64>();
        let work = Filmed {
            setup_s: done.seconds - frames_s - video_s,
            levels_s: 0.0,
            frames_s: (frames_s + video_s) * part,
            held_bytes: done.held_bytes,
            output_bytes: written * part,
        };
        let mut forecast = cost::film(&work);
        forecast.assumptions.push(format!("all frames take the time of {} that are spread over the flight, on this machine", counts.1));
        let facts = [("frames", counts.0), ("sampled_frames", counts.1)].into_iter().map(|(name, n)| (name.to_owned(), n.into())).collect();
        Ok(Told { command: "scene fly", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.output
    }
}

/// Temperatures that are drawn black and white.
#[derive(Debug, Clone, Copy)]
struct GreyScale {
    black_k: f64,
    white_k: f64,
}

impl GreyScale {
    /// The given temperatures, or percentiles of the first frame.
    fn new(mut values: Vec<f64>, args: &FlyArgs) -> Result<Self> {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((share * values.len() as f64) as usize).min(values.len() - 1)];
        let black_k = args.black.map_or_else(|| at(0.005), Temperature::si);
        let white_k = args.white.map_or_else(|| at(0.995), Temperature::si);
        let given = args.black.is_some() || args.white.is_some();
        if given && !(white_k > black_k) {
            return Err(Failure::usage(format!("black is {black_k} K and white is {white_k} K, expected white above black")));
        }
        // A first frame of one temperature has no range of its own.
        Ok(Self { black_k, white_k: if white_k > black_k { white_k } else { black_k + 1.0 } })
    }
}

/// Why there is no film.
enum NoFilm {
    /// ffmpeg is not installed.
    Missing,
    /// What ffmpeg said.
    Failed(String),
}

/// Make a film of the frames in a folder.
fn film(folder: &Path, frames_per_second: f64) -> std::result::Result<(), NoFilm> {
    let done = Command::new("ffmpeg")
        .current_dir(folder)
        .args(["-hide_banner", "-loglevel", "error", "-framerate", &frames_per_second.to_string(), "-i", "frame-%05d.png"])
        // Many players need even sides and colours of half the resolution.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", FILM])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .output();
    match done {
        Ok(said) if said.status.success() => Ok(()),
        Ok(said) => Err(NoFilm::Failed(String::from_utf8_lossy(&said.stderr).trim().to_owned())),
        Err(_) => Err(NoFilm::Missing),
    }
}
