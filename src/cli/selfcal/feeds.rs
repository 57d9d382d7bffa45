//! Leakages and the phase between the feeds, after the gains.

use super::super::context::Context;
use super::super::failure::Result;
use crate::calibrate::{
    Accuracy, ApplyOptions, CalibratedSource, FeedTerm, LeakageSolution, SkyPrediction, SolveOptions, solve as gain_solution,
    solve_leakages,
};
use crate::deconvolve::CleanOptions;
use crate::imaging::{Imager, ImagingOptions, clean};
use crate::progress::Quiet;
use crate::simulate::SkyModel;
use cittert_arrays::{ArrayError, GainTable, Image, Polarization, VisibilitySource};
use ndarray::{Axis, Zip, concatenate};
use num_complex::Complex64;
use serde_json::{Value, json};

/// Passes of imaging (where no model is given), solving leakages, and solving the gains that they had spoilt.
const PASSES: usize = 4;

/// Solve `terms` in data calibrated by `gains`, and put them into the gains.
///
/// The model is the given one. Without one it is made of clean images of I, Q, U and V of the calibrated data. Leakages spoil gains that were solved
/// without them, so each pass solves the gains again with the leakages of the one before taken out.
pub(super) fn solve(
    (terms, apply, options): (&[FeedTerm], ApplyOptions, &SolveOptions),
    (source, sky): (&mut dyn VisibilitySource, Option<&SkyModel>),
    gains: &GainTable,
    (imaging, clean): (&ImagingOptions, &CleanOptions),
    context: &Context,
) -> Result<(GainTable, LeakageSolution)> {
    let accuracy = Accuracy { epsilon: imaging.epsilon, no_w: imaging.no_w };
    let quiet = Quiet(&context.console);
    let mut own = gains.with_each_feed();
    let mut table = own.clone();
    let mut solution = None;
    for pass in 0..PASSES {
        let made;
        let model = match sky {
            Some(sky) => sky,
            None => {
                let mut calibrated = CalibratedSource::new(source, &table, apply)?;
                made = SkyModel::of_image(stokes_image(&mut calibrated, (imaging, clean), &quiet)?);
                &made
            }
        };
        let mut prediction = SkyPrediction::new(source.header(), model, accuracy, &quiet)?;
        if pass > 0 {
            let mut calibrated = CalibratedSource::new(source, &table, apply)?;
            let left = gain_solution(&mut calibrated, &mut prediction, options, &quiet)?.gains.with_each_feed();
            // Both have the intervals, channels and feeds of the options.
            if left.gains.dim() == own.gains.dim() {
                Zip::from(&mut own.gains)
                    .and(&left.gains)
                    .and(&left.flags)
                    .for_each(|g, l, flag| *g *= if *flag { Complex64::ONE } else { *l });
                own.turn_feeds_together();
            }
        }
        let mut calibrated = CalibratedSource::new(source, &own, apply)?;
        let found = solve_leakages(&mut calibrated, &mut prediction, terms, &context.console)?;
        table = found.put_into(&own)?;
        solution = Some(found);
    }
    let solution = solution.ok_or_else(|| crate::ChainError::Internal("no pass over the leakages".into()))?;
    for what in &solution.undetermined {
        context.console.warn(&format!("the data do not determine {what}; it is left at 0"));
    }
    Ok((table, solution))
}

/// Models of I, Q, U and V by CLEAN.
fn stokes_image(
    source: &mut dyn VisibilitySource,
    (imaging, options): (&ImagingOptions, &CleanOptions),
    quiet: &Quiet<'_>,
) -> Result<Image> {
    let mut planes = Vec::new();
    for pol in [Polarization::I, Polarization::Q, Polarization::U, Polarization::V] {
        let of = ImagingOptions { pol, ..imaging.clone() };
        planes.push(clean(&mut Imager::new(source, of, quiet)?, options, quiet)?.model);
    }
    let mut image = planes[0].clone();
    let views: Vec<_> = planes.iter().map(|p| p.data.view()).collect();
    image.data = concatenate(Axis(1), &views).map_err(|e| ArrayError::Parse(e.to_string()))?;
    image.polarizations = planes.iter().flat_map(|p| p.polarizations.clone()).collect();
    Ok(image)
}

/// The solution in numbers.
pub(super) fn json(solution: &LeakageSolution, terms: &[FeedTerm]) -> Value {
    let all = solution.leakages.iter().flatten();
    let rms = (all.clone().map(|d| d.norm_sqr()).sum::<f64>() / all.count().max(1) as f64).sqrt();
    let sigmas: Vec<f64> = solution.sigma.iter().flatten().flatten().copied().filter(|s| s.is_finite()).collect();
    let sigma = (sigmas.iter().map(|s| s * s).sum::<f64>() / sigmas.len().max(1) as f64).sqrt();
    json!({
        "terms": terms, "leakage_rms": rms, "leakage_sigma": sigma, "cross_phase_rad": solution.cross_phase_rad,
        "cross_phase_sigma_rad": solution.cross_sigma_rad, "not_determined": solution.undetermined, "reduced_chi2": solution.reduced_chi2,
        "steps": solution.iterations,
    })
}

/// The solution in one line.
pub(super) fn line(json: &Value) -> String {
    let number = |key: &str| json[key].as_f64().unwrap_or(f64::NAN);
    format!(
        "feeds         leakage rms {:.4} (sigma {:.4}), phase between the feeds {:.2} deg (sigma {:.2}), chi2/datum {:.3}\n              \
         the images and the figures above are from before leakages were taken out: image the calibrated set again\n",
        number("leakage_rms"),
        number("leakage_sigma"),
        number("cross_phase_rad").to_degrees(),
        number("cross_phase_sigma_rad").to_degrees(),
        number("reduced_chi2")
    )
}
