//! Pointing offsets, from the calibrated data and the model.

use crate::calibrate::{Calibrated, CalibratedSource, PointingReport, PointingSolveOptions, RoundOptions, solve_pointings};
use crate::cli::context::Context;
use crate::cli::failure::Result;
use crate::cli::options::OutputArgs;
use crate::cli::predict::load_model;
use crate::cli::text::angle;
use crate::imaging::CleanProducts;
use crate::progress::{Event, Observer};
use crate::simulate::SkyModel;
use cittert_arrays::VisibilitySource;
use serde_json::{Value, json};
use std::path::PathBuf;

/// Ending of the file of the offsets.
pub(super) const SUFFIX: &str = "-pointing.csv";

/// What was found and written.
pub(super) struct Turned {
    pub(super) path: PathBuf,
    pub(super) json: Value,
    pub(super) text: String,
}

/// Solve the offsets, if they were asked for, and write them beside the gains.
pub(super) fn solve(
    (pointing, rounds, out): (&PointingSolveOptions, &RoundOptions, &OutputArgs),
    (source, result): (&mut dyn VisibilitySource, &Calibrated),
    products: &CleanProducts,
    context: &Context,
) -> Result<Option<Turned>> {
    if !pointing.pointing {
        return Ok(None);
    }
    let header = source.header().clone();
    let sky = match &rounds.model {
        Some(path) => load_model(path, &header, context)?,
        None => SkyModel::of_image(products.model.clone()),
    };
    let mut data = CalibratedSource::new(source, &result.gains, rounds.apply())?;
    let found = solve_pointings(&mut data, &sky, pointing.pointing_interval, &rounds.judge(), &context.console)?;
    let path = out.suffixed(SUFFIX);
    cittert_formats::write_pointings(&path, &header.layout, &found.pointings, out.overwrite)?;
    if found.supported == Some(false) {
        let text = "the held-out baselines do not support the pointing offsets: they are not known better than that all are 0";
        context.console.event(Event::Warning(text));
    }
    let (rms, sigma) = sizes(&found);
    let json = json!({
        "file": path, "supported": found.supported, "rms_offset_rad": rms, "rms_sigma_rad": sigma,
        "held_out_misfit": found.misfit, "sigmas": found.sigmas, "n_intervals": found.pointings.time_jd.len(),
    });
    let verdict = match found.supported {
        Some(true) => "supported by the held-out baselines",
        Some(false) => "not supported by the held-out baselines",
        None => "not judged",
    };
    let text = format!("offsets of {} rms along each axis, known to {}; {verdict}", angle(rms), angle(sigma));
    Ok(Some(Turned { path, json, text }))
}

/// Rms of the offsets and of their standard deviations, along each axis.
fn sizes(found: &PointingReport) -> (f64, f64) {
    let n = 2.0 * found.pointings.antennas.len().max(1) as f64;
    let offsets: f64 = found.pointings.antennas.iter().map(|p| p.l * p.l + p.m * p.m).sum();
    let sigma: f64 = found.pointings.sigma_rad.iter().flatten().flatten().map(|s| s * s).sum();
    ((offsets / n).sqrt(), (sigma / n).sqrt())
}
