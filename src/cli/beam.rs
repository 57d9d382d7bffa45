//! `beam`: the dirty beam, and the noise of the dirty image beside it.

use super::context::{Context, Outcome};
use super::failure::{Failure, Result, ensure};
use super::forecast::{Plan, Planner, Told};
use super::options::ImageOfArgs;
use super::text::{angle, beam, note_beam, number};
use crate::cost::{self, WavePasses};
use crate::imaging::{CorrectionOptions, DeltaT, Imager, ImagingOptions, Products, delta_t, psf_image};
use crate::progress::Observer;
use cittert_arrays::VisibilitySource;
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Options of `beam`.
#[derive(Debug, Args)]
pub struct BeamArgs {
    #[command(flatten)]
    of: ImageOfArgs,
    /// Write a map of the noise of the dirty image to this FITS file: its standard deviation at each pixel, as the weights predict it, or the scene
    /// and the receivers where the set has total power.
    #[arg(long, value_name = "FITS")]
    delta_t: Option<PathBuf>,
    #[command(flatten)]
    correction: CorrectionOptions,
}

/// Make the dirty beam and write it as FITS.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &BeamArgs, context: &Context) -> Result<Outcome> {
    let idle = args.correction.pbcor && args.delta_t.is_none();
    ensure!(!idle, Failure::usage("--pbcor divides the map of the noise by the pattern: give --delta-t too, or leave --pbcor out"));
    let products = match &args.delta_t {
        Some(path) => {
            args.of.claim_beside(path)?;
            let (mut source, imaging) = args.of.opened(context)?;
            Some(Products::read(source.as_mut(), imaging.pol, imaging.memory)?)
        }
        None => None,
    };
    let ((mut image, beams), noise) = args.of.imaged("imaging", context, |imager| {
        args.correction.check(&imager.header().layout.pattern)?;
        let made = psf_image(imager, &context.console)?;
        let noise = products.map(|p| delta_t(imager, &p, &made.1, &context.console)).transpose()?;
        Ok((made, noise))
    })?;
    let path = args.of.write(&mut image, context)?;
    let g = &image.grid;
    let mut json = json!({ "output": path, "size": [g.n_l, g.n_m], "cell_rad": g.cell_rad });
    let mut text = format!("{}: {} x {} pixels of {}", path.display(), g.n_l, g.n_m, angle(g.cell_rad));
    note_beam(&mut json, &beams);
    if let Some(b) = beams.first() {
        text += &format!("\nmain lobe {}", beam(b));
    }
    let mut outcome = Outcome::new(json, text).wrote(path);
    if let (Some(path), Some(DeltaT { image, of_fields, step })) = (&args.delta_t, noise) {
        let mut image = if args.correction.pbcor { args.correction.corrected(&image) } else { image };
        args.of.out.image(path, &mut image, context)?;
        let unit = image.unit.bunit();
        let plane = image.plane(0, 0);
        let centre = f64::from(plane[(plane.nrows() / 2, plane.ncols() / 2)]);
        let finite = || plane.iter().map(|v| f64::from(*v)).filter(|v| v.is_finite());
        let (least, most) = (finite().fold(f64::INFINITY, f64::min), finite().fold(0.0, f64::max));
        outcome.json["delta_t"] = json!({
            "output": path, "unit": unit, "centre": centre, "min": least, "max": most, "step": step,
            "from": if of_fields { "fields" } else { "weights" },
        });
        outcome.text += &format!(
            "\n{}: noise of the dirty image {} {unit} in the centre, {} to {} over the field",
            path.display(),
            number(centre),
            number(least),
            number(most)
        );
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

impl Plan for BeamArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        let perform = |source: &mut dyn VisibilitySource, imaging: ImagingOptions, (path, watch): (&Path, &dyn Observer)| {
            let mut imager = Imager::new(source, imaging, watch)?;
            let (image, _) = psf_image(&mut imager, watch)?;
            self.of.out.signed_image(path, &image)
        };
        self.of.planned("beam", planner, (cost::beam, WavePasses::of_beam), Some(&perform))
    }

    fn output(&self) -> &std::path::Path {
        &self.of.out.output
    }
}
