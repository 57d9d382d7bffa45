//! The verdict on a fit as commands report it: warnings, a line of text, and entries of the JSON object.

use super::context::Context;
use super::failure::Result;
use super::forecast::measured;
use crate::ChainError;
use crate::calibrate::{Accuracy, ModelVisibilities, SkyPrediction};
use crate::fourier::GridOptions;
use crate::imaging::{Field, ImagingOptions, Outlook, RowSample};
use crate::progress::Quiet;
use crate::simulate::SkyModel;
use crate::verdict::{
    Finding, ImageFacts, Levels, Residuals, left_beyond_noise, look_outside, of_image, of_pedestal, of_residuals, sentence,
    something_is_left,
};
use cittert_arrays::{BrightnessUnit, Image, Polarization, Ranks, VisibilityHeader, VisibilitySource};
use serde_json::{Value, json};

/// Accuracy of the prediction. The rules compare with the noise of single visibilities, which is larger.
pub(super) const EPSILON: f64 = 1e-4;

/// What is doubtful about a fit, and the residuals that it was judged by.
#[derive(Debug, Default)]
pub(super) struct Judged {
    /// The findings.
    pub(super) findings: Vec<Finding>,
    residuals: Option<Residuals>,
    /// True where a source outside the image was sought.
    searched: bool,
}

/// The findings about the image of a model. Images of other products than total intensity may be negative and are not judged.
///
/// # Errors
/// The data cannot be read.
pub(super) fn of_model(
    data: &mut dyn VisibilitySource,
    (model, imaging): (Image, &ImagingOptions),
    facts: &ImageFacts<'_>,
    context: &Context,
) -> Result<Judged> {
    let header = data.header().clone();
    if imaging.pol != Polarization::I {
        return Ok(Judged::default());
    }
    // Without its zero spacing a thermal scene may have any flux.
    let positive = model.unit == BrightnessUnit::JyPerPixel;
    let flux = positive.then(|| model.data.sum() / model.spectrum.n_chan().max(1) as f64);
    let grid = model.grid.clone();
    let surface = imaging.surface_of(&header.near_field)?;
    // Of a scene near the array the image shows one surface, outside which there is no direction.
    let around = surface.is_none().then_some(&grid);
    let sky = SkyModel::of_image(model).at(surface);
    let accuracy = Accuracy { epsilon: EPSILON, no_w: imaging.no_w };
    let quiet = Quiet(&context.console);
    let mut predicted = match SkyPrediction::new(&header, &sky, accuracy, &quiet) {
        Ok(predicted) => predicted.expecting(looked_at(&header, data.n_rows())),
        Err(ChainError::Cancelled) => return Err(ChainError::Cancelled.into()),
        // A set that a model cannot be predicted for, such as one of correlations without total intensity, has no residuals to judge by.
        Err(_) => return Ok(Judged { findings: of_image(facts, None), ..Judged::default() }),
    };
    let mut judged = of_prediction(data, &mut predicted, (flux, facts))?;
    if let Some(grid) = around.filter(|_| something_is_missing(&*data.ranks(), &judged)) {
        judged.searched = true;
        if let Some(source) = look_outside(data, &mut predicted, judged.residuals.as_ref(), (grid, accuracy))? {
            judged.findings.insert(0, source.finding(grid, header.unit));
        }
    }
    Ok(judged)
}

/// The seconds of a verdict on a model, and whether a source outside was sought. The levels of the images, which take no time, are those of the model.
///
/// # Errors
/// The data cannot be read.
pub(super) fn timed(data: &mut dyn VisibilitySource, (model, imaging): (Image, &ImagingOptions), context: &Context) -> Result<(f64, bool)> {
    let levels = Levels::of(&model);
    let facts = ImageFacts { restored: levels, residual: levels, beam: None, stop: &[] };
    let judged = measured(|| of_model(data, (model, imaging), &facts, context))?;
    Ok((judged.seconds, judged.result.searched))
}

/// Whether the residuals that process 0 has show that something is missing.
fn something_is_missing(ranks: &dyn Ranks, judged: &Judged) -> bool {
    let mut missing = [f64::from(u8::from(judged.residuals.as_ref().is_some_and(something_is_left)))];
    ranks.largest(&mut missing);
    missing[0] > 0.0
}

/// Visibilities of one product that a verdict looks at. They are few enough for a transform in little memory, however large the set is.
fn looked_at(header: &VisibilityHeader, n_rows: usize) -> usize {
    let n_chan = header.spectrum.n_chan();
    Residuals::rows(n_rows, n_chan * header.polarizations.len()) * n_chan
}

/// The transform by which a verdict on an image of these rows predicts visibilities; `None` where there is none to predict. An image near the array is
/// predicted by spherical waves, and has none in its outlook.
///
/// # Errors
/// No transform reaches the accuracy.
pub(super) fn transform(
    header: &VisibilityHeader,
    (outlook, sample): &(Outlook, RowSample),
    imaging: &ImagingOptions,
    near: bool,
) -> Result<Option<Field>> {
    if imaging.pol != Polarization::I {
        return Ok(None);
    }
    if near {
        return Ok(Some(outlook.image));
    }
    let options = GridOptions { epsilon: EPSILON, w_term: !imaging.no_w, divide_by_n: false, ..GridOptions::default() };
    let n_vis = looked_at(header, outlook.shape.0 as usize) as u64;
    let of_output = header.spectrum.n_chan().div_ceil(outlook.channels_out.max(1));
    let freq_hz: Vec<f64> = header.spectrum.freq_hz().iter().copied().take(of_output).collect();
    Ok(Some(sample.field_for(&outlook.grid, &freq_hz, outlook.extent.with_room(), (&options, Some(n_vis)))?))
}

/// The findings about an image whose model predicts visibilities itself. `flux` is that of the model, where it must be positive.
///
/// # Errors
/// The data cannot be read.
fn of_prediction(
    data: &mut dyn VisibilitySource,
    model: &mut dyn ModelVisibilities,
    (flux, facts): (Option<f64>, &ImageFacts<'_>),
) -> Result<Judged> {
    let header: VisibilityHeader = data.header().clone();
    let residuals = Residuals::measure(data, model)?;
    let antennas = header.layout.antennas();
    let name = |k: usize| antennas.get(k).map_or_else(|| k.to_string(), |a| a.name.clone());
    let mut findings = residuals.as_ref().map_or_else(Vec::new, |r| of_residuals(r, &name, flux));
    findings.extend(of_image(facts, residuals.as_ref()));
    if let Some(pedestal) = of_pedestal(&header) {
        // The set knows the right pedestal, so it need not be guessed from the image.
        findings.retain(|f| f.name != pedestal.name);
        findings.push(pedestal);
    }
    Ok(Judged { findings, residuals, searched: false })
}

/// Print each finding as a warning.
pub(super) fn warn(findings: &[Finding], context: &Context) {
    for f in findings {
        context.console.warn(&format!("{}. What to do: {}", f.says, f.next));
    }
}

/// Report findings: warnings on the console, `verdict` and `findings` in the JSON object, and a line of text.
pub(super) fn report(judged: &Judged, good: &str, json: &mut Value, context: &Context) -> String {
    let findings = &judged.findings;
    warn(findings, context);
    let limit = judged.residuals.as_ref().and_then(left_beyond_noise).map_or_else(String::new, |says| format!(", {says}"));
    let verdict = sentence(findings, &format!("{good}{limit}"));
    if json["verdict"].is_null() {
        json["verdict"] = verdict.clone().into();
    }
    json["findings"] = json!(findings);
    if let Some(r) = &judged.residuals {
        json["residuals"] = json!({
            "visibilities": r.samples, "noise_known": r.noise_known, "mean_square": r.mean, "typical_square": r.typical,
            "unexplained": r.unexplained, "outliers": r.outliers,
            "shortest_baselines": r.shortest.0, "zero_spacing": r.zero_spacing(), "worst_antenna_ratio": r.antennas.first().map(|a| a.1),
        });
    }
    format!("verdict       {verdict}")
}
