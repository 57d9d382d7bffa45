//! `dirty`: the dirty image.

use super::context::{Context, Outcome};
use super::failure::Result;
use super::options::ImageOfArgs;
use super::text::{angle, number};
use super::zero_spacing;
use crate::fidelity::robust_rms;
use crate::imaging::{CorrectionOptions, dirty_image};
use clap::Args;
use serde_json::json;

/// Options of `dirty`.
#[derive(Debug, Args)]
pub struct DirtyArgs {
    #[command(flatten)]
    of: ImageOfArgs,
    #[command(flatten)]
    correction: CorrectionOptions,
}

/// Make the dirty image and write it as FITS.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &DirtyArgs, context: &Context) -> Result<Outcome> {
    let (mut image, counts, mean) = args.of.imaged("imaging", context, |imager| {
        args.correction.check(&imager.header().layout.pattern)?;
        let mean = zero_spacing::of(imager, false, context);
        Ok((dirty_image(imager, true, &context.console)?, imager.survey().counts, mean))
    })?;
    let path = if args.correction.pbcor {
        args.of.write(&mut args.correction.corrected(&image), context)?
    } else {
        args.of.write(&mut image, context)?
    };
    let peak = image.data.iter().fold(0.0_f32, |p, v| if v.abs() > p.abs() { *v } else { p });
    let peak = f64::from(peak);
    let (g, plane) = (&image.grid, image.plane(0, 0));
    let rms = (plane.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>() / plane.len() as f64).sqrt();
    let json = json!({
        "output": path, "size": [g.n_l, g.n_m], "cell_rad": g.cell_rad, "unit": image.unit.bunit(),
        "peak": peak, "rms": rms, "robust_rms": robust_rms(plane),
        "n_visibilities": counts.total, "n_used": counts.used, "n_flagged": counts.flagged,
        "n_bad_weight": counts.bad_weight, "n_not_finite": counts.not_finite, "n_autocorrelations": counts.autocorrelations, "mean": mean,
    });
    let text = format!(
        "{}: {} x {} pixels of {}, peak {} {}, rms {}",
        path.display(),
        g.n_l,
        g.n_m,
        angle(g.cell_rad),
        number(peak),
        image.unit.bunit(),
        number(rms)
    );
    Ok(Outcome::new(json, text).wrote(path))
}
