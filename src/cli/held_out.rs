//! `--hold-out`: a second image without some baselines, which tells whether the image predicts what it was not made from.

use super::context::Context;
use super::failure::{Failure, Result};
use super::verdict::{EPSILON, Judged};
use crate::calibrate::Accuracy;
use crate::imaging::ImagingOptions;
use crate::progress::Quiet;
use crate::simulate::SkyModel;
use crate::verdict::CrossCheck;
use cittert_arrays::{Image, Polarization, SkyGrid, VisibilitySource, place_among};
use clap::Args;
use serde_json::{Value, json};

/// The fraction that is left out by default.
const FRACTION: f64 = 0.15;
/// A second image takes as long as the first. By default it is made of sets with at most so many visibilities and for at most so many pixels:
/// larger sets constrain their images well.
const MOST: usize = 1 << 20;

/// The option.
#[derive(Debug, Args)]
pub(super) struct HoldOutArgs {
    /// Make a second image without this fraction of the baselines, and judge the first by how well the second predicts them; 0 for none
    /// [default: 0.15, but 0 for more than 1048576 visibilities or pixels].
    #[arg(long, value_name = "X", help_heading = "Judgement")]
    hold_out: Option<f64>,
}

impl HoldOutArgs {
    /// Refuse a fraction that is not possible.
    ///
    /// # Errors
    /// A fraction below 0 or above 0.5.
    pub(super) fn check(&self) -> Result<()> {
        match self.hold_out {
            Some(x) if !(0.0..=0.5).contains(&x) => Err(Failure::usage(format!("--hold-out is {x}, expected 0 (no judgement) to 0.5"))),
            _ => Ok(()),
        }
    }

    /// Whether the user has given a fraction.
    pub(super) fn is_given(&self) -> bool {
        self.hold_out.is_some()
    }

    /// Whether a second image will be made.
    pub(super) fn is_made(&self, data: &dyn VisibilitySource, grid: &SkyGrid, imaging: &ImagingOptions) -> bool {
        self.fraction(data, grid, imaging) > 0.0
    }

    /// The fraction that is left out; 0 where no second image is made. All processes that share the set must ask.
    fn fraction(&self, data: &dyn VisibilitySource, grid: &SkyGrid, imaging: &ImagingOptions) -> f64 {
        if imaging.pol != Polarization::I {
            return 0.0;
        }
        let pixels = grid.n_l.saturating_mul(grid.n_m).saturating_mul(imaging.channels_out);
        let (_, rows) = place_among(&*data.ranks(), data.n_rows());
        let visibilities = rows.saturating_mul(data.header().spectrum.n_chan()).saturating_mul(data.header().polarizations.len());
        let small = visibilities <= MOST && pixels <= MOST;
        self.hold_out.unwrap_or(if small { FRACTION } else { 0.0 })
    }

    /// Image again without some baselines by `make`, which gets the options of the same grid, and add what this says to the judgement of the first image.
    ///
    /// # Errors
    /// The data cannot be read, or the work is cancelled.
    pub(super) fn judge(
        &self,
        data: &mut dyn VisibilitySource,
        (grid, imaging): (&SkyGrid, &ImagingOptions),
        judged: &mut Judged,
        make: &dyn Fn(&mut dyn VisibilitySource, &ImagingOptions) -> crate::Result<Image>,
        context: &Context,
    ) -> Result<Option<CrossCheck>> {
        let fraction = self.fraction(data, grid, imaging);
        if fraction == 0.0 {
            return Ok(None);
        }
        let same = imaging.on_grid(grid);
        let accuracy = Accuracy { epsilon: EPSILON, no_w: imaging.no_w };
        let surface = imaging.surface_of(&data.header().near_field)?;
        let mut model = |data: &mut dyn VisibilitySource| Ok(SkyModel::of_image(make(data, &same)?).at(surface.clone()));
        let check = CrossCheck::of(data, fraction, &mut model, accuracy, &Quiet(&context.console))?;
        // An image that does not even explain its own data needs no second doubt.
        if judged.findings.iter().all(|f| f.name != "chi_squared") {
            judged.findings.extend(check.and_then(|c| c.finding()));
        }
        Ok(check)
    }
}

/// What the second image told, as JSON and as a line of text; an empty text where there was none.
pub(super) fn line(check: Option<CrossCheck>, json: &mut Value) -> String {
    let Some(c) = check else { return String::new() };
    json["held_out"] = json!({ "baselines": c.baselines, "misfit": c.misfit, "misfit_sigma": c.sigma });
    format!("held out      {} baselines; an image without them leaves {:.2} % of their power unexplained\n", c.baselines, 100.0 * c.misfit)
}
