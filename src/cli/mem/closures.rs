//! Images from closure quantities and amplitudes: `mem --terms`.

use super::args::MemCommandArgs;
use crate::cli::context::{Context, Outcome};
use crate::cli::cycle_log;
use crate::cli::failure::{Context as _, Result};
use crate::cli::options::OutputArgs;
use crate::cli::text::{angle, number};
use crate::closure_imaging::{ClosureImage, ClosureImagingOptions, FluxFrom, SparseSet, reconstruct};
use crate::imaging::{BeamShape, with_beam};
use cittert_arrays::{BrightnessUnit, Image, RestoringBeam, SkyGrid, SpectralWindow, VisUnit, VisibilityHeader};
use ndarray::{Array2, Axis};
use serde_json::{Value, json};
use std::time::Instant;

const MODEL: &str = "-model.fits";
const RESIDUAL: &str = "-residual.fits";
const IMAGE: &str = "-image.fits";
const SPREAD: &str = "-spread.fits";
/// The restored image is the model smoothed to this fraction of 1 / (longest baseline). Positivity and the prior resolve finer structure than
/// the longest baseline.
const RESTORED: f64 = 0.5;
/// Reduced chi squared above which the data are not explained.
const POOR: f64 = 1.5;

/// Make the image and write PREFIX-model, -residual and -image .fits, and -spread.fits if there are several starts.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub(super) fn run(args: &MemCommandArgs, context: &Context) -> Result<Outcome> {
    let suffixes: &[&str] = &[MODEL, RESIDUAL, IMAGE, SPREAD];
    let input = args.input.files()?;
    args.claim(args.out.all_suffixed(suffixes), &input)?;
    cycle_log::open(args.log.as_deref(), context)?;
    let what = format!("imaging {input}");
    let clock = Instant::now();
    let mut source = input.open_chosen(&args.column, context)?;
    let console = &context.console;
    let options = options(args, source.header().unit).context(&what)?;
    let set = SparseSet::gather(source.as_mut(), options.polarization, options.average, options.systematic, console).context(&what)?;
    let reading = clock.elapsed().as_secs_f64();
    let header = source.header();
    let c = set.counts;
    if c.used < c.total {
        console.note(&format!("{}; these are not used", c.left_out(options.polarization.name())));
    }
    let frame = header.phase_centers.get(set.phase_center).map_or(cittert_arrays::SkyFrame::Boresight, SkyGrid::frame_of);
    let image = reconstruct(&set, frame, &options, console).context(&what)?;
    let width = RESTORED * image.resolution_rad;
    let beam = args.imaging.beam.map(BeamShape::restoring).unwrap_or(RestoringBeam { bmaj_rad: width, bmin_rad: width, bpa_rad: 0.0 });
    let json = statistics(&image, &set, &beam, (&args.out, reading));
    let outcome = Outcome::new(json, describe(&image, &set));
    for m in image.misfits.iter().filter(|m| m.name.contains("closure") && m.chi2_per_datum > POOR) {
        console.warn(&format!("chi squared of the {} is {:.2} a datum: the image does not explain them", m.name, m.chi2_per_datum));
    }
    let restored = with_beam(&image.grid, image.model.view(), &beam);
    let planes =
        [(MODEL, Some(&image.model)), (RESIDUAL, Some(&image.residual)), (IMAGE, Some(&restored)), (SPREAD, image.spread.as_ref())];
    let named = planes.into_iter().filter_map(|(suffix, plane)| Some((suffix, plane?)));
    let fits = named.map(|(suffix, plane)| {
        let mut fits = fits_image(header, &set, &image.grid, plane, (suffix, &beam))?;
        fits.polarizations = vec![options.polarization];
        Ok((suffix, fits))
    });
    args.out.images(fits.collect::<Result<Vec<_>>>()?, context, outcome)
}

/// The options of the image of a set in this unit.
///
/// # Errors
/// One that is out of its range.
pub(super) fn options(args: &MemCommandArgs, unit: VisUnit) -> crate::Result<ClosureImagingOptions> {
    let flux = args.mem.flux.map(|f| f.in_unit("flux", unit)).transpose()?;
    let options = ClosureImagingOptions {
        polarization: args.imaging.pol,
        size: args.imaging.size,
        cell: args.imaging.cell,
        flux: flux.map_or(FluxFrom::Likelihood, FluxFrom::Given),
        ..args.terms.clone()
    };
    options.check()?;
    Ok(options)
}

/// A plane in flux a cell (model, spread) or a beam (the others) as an image in the unit of the set.
fn fits_image(
    header: &VisibilityHeader,
    set: &SparseSet,
    grid: &SkyGrid,
    plane: &Array2<f64>,
    (suffix, beam): (&str, &RestoringBeam),
) -> Result<Image> {
    let per_cell = suffix == MODEL || suffix == SPREAD;
    let kelvin = header.unit == VisUnit::KelvinSr;
    let solid_angle = match (kelvin, per_cell) {
        (false, _) => 1.0,
        (true, true) => grid.cell_sr(),
        (true, false) => beam.solid_angle_sr(),
    };
    let unit = match (kelvin, per_cell) {
        (true, _) => BrightnessUnit::Kelvin,
        (false, true) => BrightnessUnit::JyPerPixel,
        (false, false) => BrightnessUnit::JyPerBeam,
    };
    let data = plane.mapv(|v| v / solid_angle).insert_axis(Axis(0)).insert_axis(Axis(0));
    let spectrum = SpectralWindow::new(vec![header.spectrum.mean_hz()], vec![header.spectrum.extent_hz()])?;
    let mut image = Image::new(grid.clone(), spectrum, vec![cittert_arrays::Polarization::I], data, unit)?;
    image.beams = if suffix == IMAGE { vec![*beam] } else { Vec::new() };
    image.telescope.clone_from(&header.telescope);
    image.object = header.phase_centers.get(set.phase_center).map_or(String::new(), |p| p.name.clone());
    image.time_jd = (!set.times_jd.is_empty()).then(|| set.times_jd.iter().sum::<f64>() / set.times_jd.len() as f64);
    image.history.clone_from(&header.history);
    Ok(image)
}

fn statistics(i: &ClosureImage, set: &SparseSet, beam: &RestoringBeam, (out, reading): (&OutputArgs, f64)) -> Value {
    let misfit = |name: &str| i.misfits.iter().find(|m| m.name.starts_with(name));
    let chi2 = |name: &str| misfit(name).map(|m| m.chi2_per_datum);
    let data = |name: &str| misfit(name).map(|m| m.data);
    let rms = (i.residual.iter().map(|v| v * v).sum::<f64>() / i.residual.len() as f64).sqrt();
    json!({
        "output": out.output, "stop_reason": "rounds done", "evaluations": i.evaluations,
        "iterations": i.evaluations, "n_visibilities": i.n_vis, "n_moments": set.times_jd.len(),
        "chi2_per_datum": chi2("visibilities"), "chi2_closure_phases": chi2("closure phases"),
        "chi2_log_closure_amplitudes": chi2("log closure"), "chi2_amplitudes": chi2("amplitudes"),
        "n_closure_phases": data("closure phases"), "n_log_closure_amplitudes": data("log closure"),
        "model_flux": i.model.sum(), "flux_wanted": i.flux, "flux_of_co_located": i.total_flux,
        "fluxes_tried": i.fluxes_tried.iter().map(|(f, l)| json!({ "flux": f, "minus_2_log_likelihood_per_datum": l })).collect::<Vec<_>>(),
        "residual_rms": rms, "residual_peak": i.residual.iter().fold(0.0_f64, |a, v| a.max(v.abs())),
        "resolution_rad": i.resolution_rad, "prior_fwhm_rad": i.prior_fwhm_rad,
        "size": [i.grid.n_l, i.grid.n_m], "cell_rad": i.grid.cell_rad, "bmaj_rad": beam.bmaj_rad, "bmin_rad": beam.bmin_rad, "bpa_rad": beam.bpa_rad,
        "gain_error": set.names.iter().zip(&i.gain_sigma).map(|(n, s)| (n.clone(), json!(s))).collect::<serde_json::Map<_, _>>(),
        "starts": i.starts.iter().map(|s| json!({ "objective": s.value, "evaluations": s.evaluations, "correlation": s.correlation })).collect::<Vec<_>>(),
        "best_start": i.best,
        "seconds": { "reading": reading, "flux": i.seconds[0], "imaging": i.seconds[1] },
    })
}

fn describe(i: &ClosureImage, set: &SparseSet) -> String {
    let mut lines = vec![format!("{} visibilities in {} scans and channels, {} evaluations", i.n_vis, set.times_jd.len(), i.evaluations)];
    lines.extend(i.misfits.iter().map(|m| format!("chi2/datum    {:.3} of {} {}", m.chi2_per_datum, m.data, m.name)));
    let how = if i.fluxes_tried.is_empty() { "as given" } else { "the likeliest" };
    let seen = i.total_flux.map_or(String::new(), |t| format!("; co-located antennas see {}", number(t)));
    lines.push(format!("model flux    {} ({how}){seen}", number(i.model.sum())));
    lines.push(format!("resolution    {}, prior {} wide", angle(i.resolution_rad), angle(i.prior_fwhm_rad)));
    let floor = i.gain_sigma.iter().copied().fold(f64::INFINITY, f64::min);
    let raised: Vec<String> =
        set.names.iter().zip(&i.gain_sigma).filter(|(_, s)| **s > 1.2 * floor).map(|(n, s)| format!("{n} {:.0} %", 100.0 * s)).collect();
    if !raised.is_empty() {
        lines.push(format!("gain errors   {:.0} %, but {}", 100.0 * floor, raised.join(", ")));
    }
    if i.starts.len() > 1 {
        let worst = i.starts.iter().map(|s| s.correlation).fold(1.0, f64::min);
        lines.push(format!("starts        {}, images correlate with the best by {worst:.3} or more", i.starts.len()));
    }
    lines.join("\n")
}
