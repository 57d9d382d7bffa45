//! `clean`: deconvolution by CLEAN.

mod forecast;

pub(super) use forecast::work_of;

use crate::ChainError;
use crate::calibrate::{ApplyOptions, CalibratedSource, StartPhases, starting_phases};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Result};
use crate::cli::held_out::{self, HoldOutArgs};
use crate::cli::options::{ColumnArgs, OutputArgs, SetArgs, SetFiles, loaded, range_file, with_range};
use crate::cli::planned::check_room_for_images;
use crate::cli::slurm::{SlurmArgs, one_job};
use crate::cli::text::{beam, chi2, note_beam, number, reasons};
use crate::cli::verdict;
use crate::cli::zero_spacing;
use crate::deconvolve::CleanOptions;
use crate::imaging::major::CleanComponent;
use crate::imaging::{CleanReport, CorrectionOptions, Imager, ImagingOptions, Kind, clean_once, pattern_image};
use crate::progress::{Quiet, Silent};
use crate::verdict::{ImageFacts, Levels};
use cittert_arrays::{BrightnessUnit, Image, SkyGrid, VisUnit, VisibilitySource};
use clap::Args;
use serde_json::{Value, json};
use std::fmt::Write;
use std::path::PathBuf;

/// Options of `clean`.
#[derive(Debug, Args)]
pub struct CleanCommandArgs {
    #[command(flatten)]
    input: SetArgs,
    #[command(flatten)]
    column: ColumnArgs,
    #[command(flatten)]
    imaging: ImagingOptions,
    #[command(flatten)]
    clean: CleanOptions,
    #[command(flatten)]
    correction: CorrectionOptions,
    #[command(flatten)]
    hold_out: HoldOutArgs,
    /// Solve the phases against a point at the phase centre first: always, never, or (auto) where the phases of baselines that do not
    /// resolve the field show that the data are not calibrated.
    #[arg(long, value_name = "WHEN", value_enum, hide_possible_values = true, default_value_t = StartPhases::Auto)]
    startmod: StartPhases,
    /// Write each major cycle as one line of JSON to this file.
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,
    #[command(flatten)]
    slurm: SlurmArgs,
    #[command(flatten)]
    out: OutputArgs,
}

const IMAGES: [&str; 5] = ["-psf.fits", "-dirty.fits", "-model.fits", "-residual.fits", "-image.fits"];
const COMPONENTS: &str = "-components.csv";
/// With `--pbcor`: the restored image divided by the pattern of the elements, and the pattern.
const CORRECTED: [&str; 2] = ["-image-pbcor.fits", "-pattern.fits"];

impl CleanCommandArgs {
    fn corrected_outputs(&self) -> Vec<PathBuf> {
        if self.correction.pbcor { self.out.all_suffixed(&CORRECTED) } else { Vec::new() }
    }
}

/// Half of the diagonal of an image, rad.
fn half_field_rad(g: &SkyGrid) -> f64 {
    0.5 * g.cell_rad * (g.n_l as f64).hypot(g.n_m as f64)
}

/// Deconvolve and write PREFIX-psf, -dirty, -model, -residual, -image .fits and -components.csv.
///
/// # Errors
/// The file or an option is wrong, or an error of the file system.
pub fn run(args: &CleanCommandArgs, context: &Context) -> Result<Outcome> {
    args.clean.check()?;
    args.clean.entry()?;
    args.hold_out.check()?;
    let mut outputs = args.out.all_suffixed(&IMAGES);
    outputs.push(args.out.suffixed(COMPONENTS));
    outputs.extend(args.corrected_outputs());
    let input = args.input.files()?;
    if args.slurm.is_wanted() {
        return one_job(&args.slurm, ("clean", Some(args)), &args.out, context);
    }
    let files = input.all().iter().map(PathBuf::as_path);
    args.out.claim(
        outputs.iter().chain(&args.log),
        files.chain(args.clean.mask.as_deref()).chain(args.imaging.range.as_ref().and_then(range_file)),
    )?;
    let imaging = with_range(&args.imaging)?;
    super::cycle_log::open(args.log.as_deref(), context)?;
    let mut source = input.open_chosen(&args.column, context)?;
    let what = format!("imaging {input}");
    let options = imaging.clone();
    let imager = Imager::new(source.as_mut(), options.clone(), &context.console).context(&what)?;
    args.correction.check(&imager.header().layout.pattern).context(&what)?;
    let half_field_rad = half_field_rad(imager.grid());
    if !args.startmod.may_solve(imager.survey().uv_range_wl.0, half_field_rad) {
        let cleaned = deconvolve(args, (&input, imager), context)?;
        return save((args, &imaging), (source.as_mut(), false), cleaned, context);
    }
    drop(imager);
    let gains = starting_phases(source.as_mut(), args.startmod, half_field_rad, &context.console).context(&what)?;
    let mut calibrated;
    let data: &mut dyn VisibilitySource = match &gains {
        Some(table) => {
            calibrated = CalibratedSource::new(source.as_mut(), table, ApplyOptions::default()).context(&what)?;
            &mut calibrated
        }
        None => source.as_mut(),
    };
    let imager = Imager::new(data, options, &Silent).context(&what)?;
    let cleaned = deconvolve(args, (&input, imager), context)?;
    save((args, &imaging), (data, gains.is_some()), cleaned, context)
}

/// What is left of a run when its images are written.
struct Written {
    report: CleanReport,
    /// The model, by which the run is judged.
    model: Image,
    restored: Levels,
    residual: Levels,
    grid: SkyGrid,
    /// Where the mean of the image is known from.
    mean: Value,
}

/// Run CLEAN and write its images one after the other, because together they would need more memory than the run.
fn deconvolve(args: &CleanCommandArgs, (input, mut imager): (&SetFiles, Imager<'_>), context: &Context) -> Result<Written> {
    check_room_for_images(IMAGES.len(), imager.grid(), &args.out.output)?;
    let mean = zero_spacing::of(&imager, false, context);
    let options = loaded(&args.clean, imager.grid())?;
    let cleaned = clean_once(&mut imager, &options, &context.console).context(format!("imaging {input}"))?;
    let (mut restored, mut residual) = (None, None);
    let (report, mut model) = cleaned.deliver(&imager, |kind, mut image| -> Result<()> {
        args.out.image(&args.out.suffixed(suffix(kind)), &mut image, context)?;
        match kind {
            Kind::Restored => {
                restored = Some(Levels::of(&image));
                if args.correction.pbcor {
                    for (suffix, mut image) in CORRECTED.into_iter().zip([args.correction.corrected(&image), pattern_image(&image)]) {
                        args.out.image(&args.out.suffixed(suffix), &mut image, context)?;
                    }
                }
            }
            Kind::Residual => residual = Some(Levels::of(&image)),
            Kind::Model | Kind::Psf | Kind::Dirty => {}
        }
        Ok(())
    })?;
    args.out.image(&args.out.suffixed(suffix(Kind::Model)), &mut model, context)?;
    match (restored, residual) {
        (Some(restored), Some(residual)) => Ok(Written { report, model, restored, residual, grid: imager.grid().clone(), mean }),
        _ => Err(ChainError::Internal("CLEAN has made no residual".into()).into()),
    }
}

fn suffix(kind: Kind) -> &'static str {
    match kind {
        Kind::Psf => IMAGES[0],
        Kind::Dirty => IMAGES[1],
        Kind::Model => IMAGES[2],
        Kind::Residual => IMAGES[3],
        Kind::Restored => IMAGES[4],
    }
}

/// Judge the images, and write the components. `started` is true where starting phases were applied to `data`.
fn save(
    (args, imaging): (&CleanCommandArgs, &ImagingOptions),
    (data, started): (&mut dyn VisibilitySource, bool),
    written: Written,
    context: &Context,
) -> Result<Outcome> {
    let Written { report, model, restored, residual, grid, mean } = written;
    let facts = ImageFacts { restored, residual, beam: report.beams.first(), stop: &report.statistics.stop };
    let mut judged = verdict::of_model(data, (model, imaging), &facts, context)?;
    let options = loaded(&args.clean, &grid)?;
    let quiet = Quiet(&context.console);
    let again = |data: &mut dyn VisibilitySource, imaging: &ImagingOptions| {
        let mut imager = Imager::new(data, imaging.clone(), &quiet)?;
        clean_once(&mut imager, &options, &quiet)?.into_model(&imager)
    };
    let check = args.hold_out.judge(data, (&grid, imaging), &mut judged, &again, context)?;
    let mut json = statistics(&report, args, (args.clean.entry()?.name, restored.unit, &grid));
    json["startmod"] = started.into();
    json["mean"] = mean;
    let held_out = held_out::line(check, &mut json);
    let verdict = verdict::report(&judged, "the image explains the visibilities", &mut json, context);
    let text = format!("{}\n{held_out}{verdict}", describe(&report, restored.unit, &json));
    let components = components(&report.components, data.header().unit);
    let outcome = IMAGES.iter().fold(Outcome::new(json, text), |outcome, suffix| outcome.wrote(args.out.suffixed(suffix)));
    let path = args.out.suffixed(COMPONENTS);
    args.out.write(&path, components.as_bytes())?;
    Ok(args.corrected_outputs().into_iter().fold(outcome.wrote(path), Outcome::wrote))
}

/// The component list. If all components are points in Jy, `simulate --scene` reads it as a source list.
pub(super) fn components(list: &[CleanComponent], unit: VisUnit) -> String {
    let scales = list.iter().any(|c| c.scale_rad > 0.0);
    let channels = list.iter().any(|c| c.channel > 0);
    let flux = if unit == VisUnit::KelvinSr { "flux_ksr" } else { "flux_jy" };
    let mut text = format!("l_rad,m_rad,{flux}");
    text += if scales { ",scale_rad" } else { "" };
    text += if channels { ",channel\n" } else { "\n" };
    for c in list {
        // Writing to a String does not fail.
        let _ = write!(text, "{:.12e},{:.12e},{:.9e}", c.l, c.m, c.flux);
        if scales {
            let _ = write!(text, ",{:.6e}", c.scale_rad);
        }
        if channels {
            let _ = write!(text, ",{}", c.channel);
        }
        text.push('\n');
    }
    text
}

fn statistics(p: &CleanReport, args: &CleanCommandArgs, (algorithm, unit, grid): (&str, BrightnessUnit, &SkyGrid)) -> Value {
    let s = &p.statistics;
    let stops: Vec<&str> = s.stop.iter().map(|r| r.name()).collect();
    let mut json = json!({
        "output": args.out.output, "algorithm": algorithm, "stop_reason": reasons(&stops), "iterations": s.iterations,
        "major_cycles": s.major_cycles, "residual_rms": s.residual_rms, "residual_peak": s.residual_peak,
        "model_flux": s.model_flux, "dynamic_range": s.dynamic_range, "chi2_per_datum": s.chi2_per_datum,
        "n_components": p.components.len(), "seconds": s.seconds, "unit": unit.bunit(),
        "size": [grid.n_l, grid.n_m], "cell_rad": grid.cell_rad,
    });
    note_beam(&mut json, &p.beams);
    json
}

fn describe(p: &CleanReport, unit: BrightnessUnit, json: &Value) -> String {
    let s = &p.statistics;
    let unit = unit.bunit();
    let mut lines = vec![
        format!(
            "{} iterations in {} major cycles; stopped: {}",
            s.iterations,
            s.major_cycles,
            json["stop_reason"].as_str().unwrap_or_default()
        ),
        format!("residual      rms {} {unit}, peak {} {unit}", number(s.residual_rms), number(s.residual_peak)),
        format!("model flux    {}", number(s.model_flux)),
        format!("dynamic range {:.0}", s.dynamic_range),
        format!("chi2/datum    {}", chi2(s.chi2_per_datum)),
    ];
    if let Some(b) = p.beams.first() {
        lines.push(format!("beam          {}", beam(b)));
    }
    lines.join("\n")
}
