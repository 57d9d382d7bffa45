//! `compare`: how far an image is from the truth.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use crate::fidelity::{CompareOptions, Region, compare};
use cittert_formats::open_image as read_image;
use clap::Args;
use std::path::PathBuf;

/// Options of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image to judge.
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// What it should be.
    #[arg(value_name = "TRUTH")]
    truth: PathBuf,
    /// Convolve the truth with the image's restoring beam first.
    #[arg(long)]
    convolve: bool,
    /// Only the disc of this radius around the middle, as a fraction of the smaller side (0.5 touches the edge).
    #[arg(long, value_name = "FRACTION")]
    disc: Option<f64>,
}

/// Compare two images on the same grid.
///
/// # Errors
/// Files that are no images, grids that do not match, a missing beam.
pub fn run(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    let image = read_image(&args.image)?;
    let truth = read_image(&args.truth)?;
    let beam = match (args.convolve, image.beams.first()) {
        (false, _) => None,
        (true, Some(beam)) => Some(*beam),
        (true, None) => {
            return Err(Failure::message(format!(
                "{}: it has no restoring beam (BMAJ, BMIN, BPA), so --convolve cannot know the beam",
                args.image.display()
            )));
        }
    };
    if image.unit != truth.unit {
        context.console.warn(&format!(
            "{} is in {:?} and {} in {:?}: the ratios compare numbers, not brightness",
            args.image.display(),
            image.unit,
            args.truth.display(),
            truth.unit
        ));
    }
    let region = args.disc.map_or(Region::All, |radius| Region::Disc { radius });
    let f = compare(&image, &truth, &CompareOptions { region, beam })
        .context(format!("comparing {} with {}", args.image.display(), args.truth.display()))?;
    let unit = image.unit.bunit();
    let text = format!(
        "rms difference {:.4e} {unit}\nNRMSE          {:.5}\ndynamic range  {:.1}\nfidelity index {:.2}\nSSIM           {:.5}\npeak ratio     {:.5}\nflux ratio     {:.5}",
        f.rms, f.nrmse, f.dynamic_range, f.fidelity, f.ssim, f.peak_ratio, f.flux_ratio
    );
    let mut json = serde_json::to_value(f)?;
    json["unit"] = unit.into();
    Ok(Outcome::new(json, text))
}
