//! `film`: what a camera with noise sees on its way through a scene, as a film, and the frame rate at which it sees best.

mod args;
mod cameras;
mod forecast;
mod frames;
mod rates;

pub use args::FilmArgs;

use super::context::{Context, Outcome};
use super::failure::{Failure, Result, ensure};
use crate::display::{FilmOptions, RateOptions};

/// Make the film, or study the frame rate.
///
/// # Errors
/// A path, a scene or an option that is wrong, a program that is missing, or an error of the file system.
pub fn run(args: &FilmArgs, context: &Context) -> Result<Outcome> {
    refuse_mixed(args)?;
    if args.rates.rates.is_empty() { frames::run(args, context) } else { rates::run(args, context) }
}

/// Refuse options that exclude each other.
///
/// # Errors
/// Such options, or one outside of its range.
fn refuse_mixed(args: &FilmArgs) -> Result<()> {
    args.film.check().map_err(Failure::call)?;
    let receivers = &args.camera.receivers;
    receivers.check().map_err(Failure::call)?;
    let twice = args.camera.sensor.is_some() && (receivers.tsys.is_some() || receivers.detectors.is_some());
    ensure!(
        !twice,
        Failure::usage("--tsys and --detectors are the noise of a camera without --sensor; write the noise into the file of the sensor")
    );
    if args.rates.rates.is_empty() {
        let seeds = args.rates.seeds != RateOptions::default().seeds;
        ensure!(!seeds, Failure::usage("--seeds needs --rates: a film has one frame of each moment"));
        return Ok(());
    }
    let plain = FilmOptions::default();
    let f = &args.film;
    let given = [
        ("rate", f.rate.is_some()),
        ("frames", f.frames.is_some()),
        ("exposures", f.exposures != plain.exposures),
        ("every", f.every != plain.every),
        ("black", f.black.is_some()),
        ("white", f.white.is_some()),
        ("levels", f.levels != plain.levels),
        ("colors", f.colors != plain.colors),
        ("no-names", f.no_names),
    ];
    if let Some((option, _)) = given.iter().find(|g| g.1) {
        return Err(Failure::usage(format!(
            "--{option} is an option of films; --rates studies the frame rate of a camera and makes no film"
        )));
    }
    Ok(())
}
