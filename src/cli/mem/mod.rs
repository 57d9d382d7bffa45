//! `mem`: images of maximum entropy, with a certificate.

mod args;
mod closure_forecast;
mod closures;
mod forecast;

pub use args::MemCommandArgs;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::held_out;
use super::options::{fits_mask, prior_image, with_range};
use super::planned::check_room_for_images;
use super::ranks;
use super::text::{beam, note_beam, number, reasons};
use super::verdict::{self, Judged};
use super::zero_spacing;
use crate::imaging::{Imager, ImagingOptions};
use crate::mem::{Certificate, MemInputs, MemPlan, MemProducts, mem};
use crate::progress::{Observer, Quiet};
use crate::verdict::{CrossCheck, ImageFacts};
use cittert_arrays::VisibilitySource;
use serde_json::{Value, json};

const IMAGES: [&str; 3] = ["-model.fits", "-residual.fits", "-image.fits"];
const UNCERTAINTY: &str = "-uncertainty.fits";

/// Image by maximum entropy and write PREFIX-model, -residual, -image and -uncertainty .fits.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system. If the constraints are not met within the limit of evaluations, the images
/// are written and the outcome is a failure.
pub fn run(args: &MemCommandArgs, context: &Context) -> Result<Outcome> {
    args.check_used()?;
    if args.terms.terms.is_some() {
        ranks::refuse_several("mem then makes no images from closures. Leave out --terms")?;
        return closures::run(args, context);
    }
    let mut outputs = args.out.all_suffixed(&IMAGES);
    outputs.push(args.out.suffixed(UNCERTAINTY));
    let input = args.input.files()?;
    args.claim(outputs, &input)?;
    super::cycle_log::open(args.log.as_deref(), context)?;
    let mut source = input.open_chosen(&args.column, context)?;
    let what = format!("imaging {input}");
    args.mem.check().map_err(Failure::call)?;
    args.hold_out.check()?;
    let imaging = with_range(&args.imaging)?;
    let (products, options, mean) = imaged(args, (source.as_mut(), &what), (&imaging, &context.console), |imager| {
        check_room_for_images(IMAGES.len(), imager.grid(), &args.out.output)?;
        Ok(zero_spacing::of(imager, args.mem.flux.is_some() || args.mem.zero_spacing.is_some(), context))
    })?;
    let source = source.as_mut();
    let mut judged = verdict::of_model(source, (products.model.clone(), &imaging), &ImageFacts::from(&products), context)?;
    let quiet = Quiet(&context.console);
    let again = |data: &mut dyn VisibilitySource, imaging: &ImagingOptions| {
        Ok(mem(&mut Imager::new(data, imaging.clone(), &quiet)?, &options, &quiet)?.model)
    };
    let check = args.hold_out.judge(source, (&products.model.grid, &imaging), &mut judged, &again, context)?;
    save(args, (products, judged, check, mean), &options, context)
}

/// The images of a set, how they were asked for, and what `look` finds out of the imager before. `what` is said with an error.
fn imaged<T>(
    args: &MemCommandArgs,
    (source, what): (&mut dyn VisibilitySource, &str),
    (imaging, observer): (&ImagingOptions, &dyn Observer),
    look: impl FnOnce(&Imager<'_>) -> Result<T>,
) -> Result<(MemProducts, MemPlan, T)> {
    let noise = args.mem.believed_noise(source, observer).context(what)?;
    let mut imager = Imager::new(source, imaging.clone(), observer).context(what)?;
    for (field, flux) in [("flux", args.mem.flux), ("zero-spacing", args.mem.zero_spacing)] {
        flux.map_or(Ok(0.0), |f| f.in_unit(field, imager.header().unit)).map_err(Failure::call)?;
    }
    let seen = look(&imager)?;
    let inputs = MemInputs {
        prior: prior_image(args.mem.prior.as_ref())?,
        mask: args.mem.mask.as_deref().map(|path| fits_mask(path, imager.grid())).transpose()?,
    };
    // An error may lie in the data or in the images that were given with them.
    let given: Vec<String> = args.given().map(|path| path.display().to_string()).collect();
    let what = if given.is_empty() { what.to_owned() } else { format!("{what} with {}", given.join(" and ")) };
    let options = args.mem.plan(&imager, inputs, noise).context(&what)?;
    let products = mem(&mut imager, &options, observer).context(&what)?;
    Ok((products, options, seen))
}

fn save(
    args: &MemCommandArgs,
    (products, judged, check, mean): (MemProducts, Judged, Option<CrossCheck>, Value),
    options: &MemPlan,
    context: &Context,
) -> Result<Outcome> {
    let mut json = statistics(&products, args, options);
    json["mean"] = mean;
    let held_out = held_out::line(check, &mut json);
    let goals = options.options.goals();
    let short = |(k, c): (usize, &Certificate)| {
        let which = if products.certificates.len() > 1 { format!("output channel {k}: ") } else { String::new() };
        c.shortfall(goals.chi2_tolerance, goals.flux, goals.kkt).map(|s| which + &s)
    };
    let missed: Vec<String> = products.certificates.iter().enumerate().filter_map(short).collect();
    let good = if missed.is_empty() { "the image explains the visibilities" } else { "doubtful: the constraints are not met" };
    let verdict = verdict::report(&judged, good, &mut json, context);
    let outcome = Outcome::new(json, format!("{}\n{held_out}{verdict}", describe(&products)));
    let images = IMAGES.into_iter().zip([products.model, products.residual, products.restored]);
    let mut outcome = args.out.images(images.chain(products.uncertainty.map(|u| (UNCERTAINTY, u))), context, outcome)?;
    if !missed.is_empty() {
        let stalled = products.certificates.iter().any(|c| c.stop_reason == "stalled");
        let advice = if stalled {
            "More steps do not help: check --noise and --cell, and whether the image is large enough for all emission"
        } else {
            "Raise --niter, or check --noise"
        };
        let text = format!("the constraints are not met: {}. The last image is kept. {advice}", missed.join("; "));
        outcome.failed = Some(text);
    }
    Ok(outcome)
}

/// The worst values over all output channels, and the values of each.
fn statistics(p: &MemProducts, args: &MemCommandArgs, options: &MemPlan) -> Value {
    let c = &p.certificates;
    let n = c.len().max(1) as f64;
    let worst = |f: fn(&Certificate) -> f64| c.iter().map(f).fold(0.0, f64::max);
    let mean = |f: fn(&Certificate) -> f64| c.iter().map(f).sum::<f64>() / n;
    // The chi squared that is furthest from 1.
    let chi2 = c.iter().map(|c| c.chi2_per_datum).fold(1.0, |a: f64, b| if (b - 1.0).abs() >= (a - 1.0).abs() { b } else { a });
    let stops: Vec<&str> = c.iter().map(|c| c.stop_reason).collect();
    let residual = &p.residual.data;
    let rms = (residual.iter().map(|v| v * v).sum::<f64>() / residual.len() as f64).sqrt();
    let top = p.restored.data.iter().copied().fold(f64::NEG_INFINITY, f64::max) - p.restored.pedestal_k.unwrap_or(0.0);
    let mut json = json!({
        "output": args.out.output, "algorithm": "mem", "stop_reason": reasons(&stops), "met": c.iter().all(|c| c.met),
        "iterations": c.iter().map(|c| c.iterations).max(), "evaluations": c.iter().map(|c| c.evaluations).max(),
        "fft_pairs": c.iter().map(|c| c.evaluations).max(), "convolutions": c.iter().map(|c| c.convolutions).max(),
        "major_cycles": c.iter().map(|c| c.iterations).max(),
        "chi2_per_datum": chi2, "flux_error": worst(|c| c.flux_error), "flux_constrained": c.iter().any(|c| c.flux_constrained),
        "kkt_residual": worst(|c| c.kkt_residual), "entropy": c.iter().map(|c| c.entropy).sum::<f64>(),
        "background": c.iter().filter_map(|c| c.background).next(), "entropy_form": options.options.entropy, "lambda": mean(|c| c.lambda), "model_flux": mean(|c| c.model_flux),
        "residual_rms": rms, "residual_peak": residual.iter().fold(0.0_f64, |a, v| a.max(v.abs())),
        "dynamic_range": top / rms.max(f64::MIN_POSITIVE),
        "seconds_per_evaluation": mean(|c| c.seconds_per_evaluation), "time_in_evaluations": worst(Certificate::time_ratio),
        "seconds": p.seconds, "unit": p.model.unit.bunit(), "size": [p.model.grid.n_l, p.model.grid.n_m], "cell_rad": p.model.grid.cell_rad,
        "channels": c,
    });
    note_beam(&mut json, &p.beams);
    json
}

fn describe(p: &MemProducts) -> String {
    let mut lines = Vec::new();
    for (k, c) in p.certificates.iter().enumerate() {
        if p.certificates.len() > 1 {
            lines.push(format!("output channel {k}"));
        }
        let flux = if c.flux_constrained { format!(", off by {:.1e}", c.flux_error) } else { ", not constrained".into() };
        lines.extend([
            format!("{} after {} evaluations ({} convolutions with the beam)", c.stop_reason, c.evaluations, c.convolutions),
            format!("chi2/N        {:.4} over {} real data", c.chi2_per_datum, c.data),
            format!("flux          {}{flux}", number(c.model_flux)),
            format!("entropy       {}", number(c.entropy)),
            c.background.map_or(String::new(), |t| format!("background    {} {}", number(t), p.model.unit.bunit())),
            format!("KKT residual  {:.1e}", c.kkt_residual),
            format!("time          {:.2} s, {:.0} times one evaluation ({:.3} s)", c.seconds, c.time_ratio(), c.seconds_per_evaluation),
        ]);
    }
    if let Some(b) = p.beams.first() {
        lines.push(format!("beam          {}", beam(b)));
    }
    lines.retain(|line| !line.is_empty());
    lines.join("\n")
}
