//! `clean`: deconvolution by CLEAN.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Result};
use super::forecast::{Plan, Planner, Told, facts, format_of, say_waves, waves_of_image};
use super::held_out::{self, HoldOutArgs};
use super::options::{ColumnArgs, OutputArgs, SetArgs, SetFiles, loaded, range_file, with_range};
use super::planned::check_room_for_images;
use super::slurm::{SlurmArgs, one_job};
use super::text::{beam, chi2, note_beam, number, reasons};
use super::verdict;
use super::zero_spacing;
use crate::ChainError;
use crate::calibrate::{ApplyOptions, CalibratedSource, StartPhases, starting_phases};
use crate::cost::{self, CleanWork, WavePasses};
use crate::deconvolve::{CleanOptions, EXTENDED, chosen_scales};
use crate::imaging::major::CleanComponent;
use crate::imaging::{CleanReport, CorrectionOptions, Imager, ImagingOptions, Kind, Outlook, clean_once, pattern_image};
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
    let g = imager.grid();
    let half_field_rad = 0.5 * g.cell_rad * (g.n_l as f64).hypot(g.n_m as f64);
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

/// The work of one CLEAN by a deconvolver with these options.
pub(super) fn work_of(clean: &CleanOptions, name: &str, outlook: &Outlook) -> CleanWork {
    let g = &outlook.grid;
    let beam_px = 1.0 / (outlook.uv_range_wl.1 * g.cell_rad);
    CleanWork {
        components: clean.niter as f64,
        gain: clean.gain,
        cycles: None,
        most_cycles: clean.max_major as f64,
        hogbom: name == "hogbom",
        scales: if name == EXTENDED { scales_of(clean, (beam_px, outlook.uv_range_wl.0 * g.cell_rad), g) } else { 0.0 },
        tested: false,
        judged: None,
        twice: false,
    }
}

/// Half of the power of the kernel of a scale lies beyond this many cycles over its width.
const HALF_POWER: f64 = 0.4;

/// Number of scales of the minor cycle, for a beam of this width and baselines from so many cycles a pixel on. A scale most of whose power lies below the shortest
/// baseline is not measured, and not used.
fn scales_of(clean: &CleanOptions, (beam_px, shortest): (f64, f64), grid: &SkyGrid) -> f64 {
    let mut scales = clean.scales(beam_px);
    if scales.widths_px.is_empty() {
        scales.widths_px = chosen_scales(&scales, &clean.tuning, grid.n_l.min(grid.n_m));
    }
    scales.widths_px.iter().filter(|width| **width * shortest <= HALF_POWER).count() as f64
}

impl Plan for CleanCommandArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        self.clean.check()?;
        let input = self.input.files()?;
        let mut source = input.open_chosen(&self.column, planner.context)?;
        let mut looked = planner.outlook(source.as_mut(), &self.imaging)?;
        let waves = waves_of_image(&self.imaging, source.header(), &mut looked.0, planner)?;
        let outlook = &looked.0;
        let g = &outlook.grid;
        let half_field_rad = 0.5 * g.cell_rad * (g.n_l as f64).hypot(g.n_m as f64);
        let work = CleanWork {
            tested: self.startmod.may_solve(outlook.uv_range_wl.0, half_field_rad),
            judged: verdict::transform(source.header(), &looked, &self.imaging, waves.is_some())?,
            twice: self.hold_out.is_made(source.as_ref(), g, &self.imaging),
            ..work_of(&self.clean, self.clean.entry()?.name, outlook)
        };
        let mut forecast = cost::clean(outlook, (format_of(&input, planner.context)?, planner.threads), &work, &planner.speeds);
        let mut facts = facts(outlook);
        if let Some(waves) = waves {
            forecast = waves.put_into(forecast, outlook, &WavePasses::of_clean(outlook, &work, (&waves, &planner.speeds)));
            forecast.assumptions.push(WavePasses::LIT_TILES.into());
            say_waves(&waves, outlook, &mut facts);
        }
        Ok(Told { command: "clean", forecast, facts })
    }

    fn output(&self) -> &std::path::Path {
        &self.out.output
    }
}
