//! `compare`: the distance of an image or a gain table from the truth.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::text::angle;
use crate::calibrate::{CompareOptions as GainOptions, compare_gains};
use crate::fidelity::{CompareOptions, Region, compare, register};
use cittert_formats::calh5::{is_gains, read_gains};
use cittert_formats::open_image as read_image;
use clap::Args;
use std::path::PathBuf;

/// Options of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image (or gain table) to judge.
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// The true image (or gain table).
    #[arg(value_name = "TRUTH")]
    truth: PathBuf,
    /// Convolve the truth with the restoring beam of the image first.
    #[arg(long)]
    convolve: bool,
    /// Compare only inside a disc around the centre. Its radius is this fraction of the smaller side (0.5 touches the edge).
    #[arg(long, value_name = "FRACTION")]
    disc: Option<f64>,
    /// Shift the image onto the truth first. Self-calibration with a free model leaves the position of the image open.
    #[arg(long)]
    shift: bool,
    /// For gain tables: remove a phase gradient over the array, which is a shift of the image.
    #[arg(long)]
    gradient: bool,
    /// For gain tables: remove one amplitude scale, which is the flux scale of the model.
    #[arg(long)]
    flux_scale: bool,
}

/// Compare two images on the same grid, or two gain tables.
///
/// # Errors
/// Files that are neither images nor gain tables, one of each, grids or antennas that do not match, a missing beam.
pub fn run(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    match (is_gains(&args.image), is_gains(&args.truth)) {
        (true, true) => gains(args),
        (false, false) => images(args, context),
        (one, _) => {
            let (gains, other) = if one { (&args.image, &args.truth) } else { (&args.truth, &args.image) };
            Err(Failure::message(format!(
                "{} is a gain table and {} is not: give two gain tables, or two images",
                gains.display(),
                other.display()
            )))
        }
    }
}

fn gains(args: &CompareArgs) -> Result<Outcome> {
    if args.convolve || args.shift || args.disc.is_some() {
        return Err(Failure::usage("--convolve, --disc and --shift are for images; gain tables take --gradient and --flux-scale"));
    }
    let (found, truth) = (read_gains(&args.image)?, read_gains(&args.truth)?);
    let options = GainOptions { gradient: args.gradient, flux_scale: args.flux_scale };
    let what = format!("comparing {} with {}", args.image.display(), args.truth.display());
    let c = compare_gains(&found, &truth, options).context(what)?;
    let mut json = serde_json::json!({
        "max_abs_phase_rad": c.max_abs_phase_rad, "rms_phase_rad": c.rms_phase_rad, "rms_amplitude": c.rms_amplitude,
        "amplitude_scale": c.amplitude_scale, "n_compared": c.compared, "n_flagged": c.flagged,
        "removed": { "common_phase": true, "gradient": args.gradient, "flux_scale": args.flux_scale },
    });
    let mut text = format!(
        "phase difference  rms {:.4e} rad, largest {:.4e} rad\namplitudes        rms {:.4e} (scale {:.5})\ngains             {} compared, {} flagged or missing in the other table",
        c.rms_phase_rad, c.max_abs_phase_rad, c.rms_amplitude, c.amplitude_scale, c.compared, c.flagged
    );
    if let Some((l, m)) = c.shift_rad {
        (json["shift_l_rad"], json["shift_m_rad"]) = (l.into(), m.into());
        text += &format!("\nimage shift       l {}, m {}", angle(l), angle(m));
    }
    Ok(Outcome::new(json, text))
}

fn images(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    if args.gradient || args.flux_scale {
        return Err(Failure::usage("--gradient and --flux-scale are for gain tables; images take --shift"));
    }
    let mut image = read_image(&args.image)?;
    let truth = read_image(&args.truth)?;
    let beam = match (args.convolve, image.beams.first()) {
        (false, _) => None,
        (true, Some(beam)) => Some(*beam),
        (true, None) => {
            return Err(Failure::message(format!(
                "{}: it has no restoring beam (BMAJ, BMIN, BPA), which --convolve needs",
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
    let mut shift = None;
    if args.shift {
        crate::fidelity::check_alignment(&image.grid, &truth.grid).context(format!(
            "{} over {}",
            args.image.display(),
            args.truth.display()
        ))?;
        let (moved, by) = register(&image, &truth).context("moving the image onto the truth")?;
        (image, shift) = (moved, Some(by));
    }
    let region = args.disc.map_or(Region::All, |radius| Region::Disc { radius });
    let f = compare(&image, &truth, &CompareOptions { region, beam }).context(format!(
        "comparing {} with {}",
        args.image.display(),
        args.truth.display()
    ))?;
    let unit = image.unit.bunit();
    let mut text = format!(
        "rms difference {:.4e} {unit}\nNRMSE          {:.5}\ndynamic range  {:.1}\nfidelity index {:.2}\nSSIM           {:.5}\npeak ratio     {:.5}\nflux ratio     {:.5}",
        f.rms, f.nrmse, f.dynamic_range, f.fidelity, f.ssim, f.peak_ratio, f.flux_ratio
    );
    let mut json = serde_json::to_value(f)?;
    json["unit"] = unit.into();
    if let Some((l, m)) = shift {
        (json["shift_l_rad"], json["shift_m_rad"]) = (l.into(), m.into());
        text += &format!("\nshifted by     l {}, m {}", angle(l), angle(m));
    }
    Ok(Outcome::new(json, text))
}
