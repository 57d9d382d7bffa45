//! `enhance`: an image through a chain of filters, and figures before and after.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::forecast::{Plan, Planner, Told, grown};
use super::numbers;
use super::options::OutputArgs;
use super::text::angle;
use crate::cost::{self, Stage, Term};
use crate::enhance::{EnhanceOptions, Measure, Metrics, Psf, STEPS, StepList, enhance};
use crate::plot::{self, ImagePlot};
use cittert_arrays::{Image, SkyGrid};
use cittert_formats::open_image;
use clap::Args;
use ndarray::s;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// Width of each picture of several side by side, pixels, and their height.
const PICTURE: (usize, usize) = (560, 620);

/// Options of `enhance`.
#[derive(Debug, Args)]
#[command(after_help = steps_help())]
pub struct EnhanceArgs {
    /// The image, FITS. Several are frames of one scene: the step average makes one of them.
    #[arg(value_name = "IMAGE", required = true)]
    images: Vec<PathBuf>,
    #[command(flatten)]
    options: EnhanceOptions,
    /// File with these options, as TOML; options of the command line replace its own. Its paths start from its folder.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    /// Do not write the picture beside the FITS file.
    #[arg(long)]
    no_png: bool,
    #[command(flatten)]
    out: OutputArgs,
}

/// The table of steps, for the help.
fn steps_help() -> String {
    let rows: Vec<(String, &str)> = STEPS.iter().map(|kind| (kind.syntax(), kind.about)).collect();
    let width = rows.iter().map(|(syntax, _)| syntax.len()).max().unwrap_or(0);
    let lines: Vec<String> = rows.iter().map(|(syntax, about)| format!("  {syntax:width$}  {about}")).collect();
    format!("Steps:\n{}", lines.join("\n"))
}

/// Enhance the image and write it as FITS and as a picture beside what it was.
///
/// # Errors
/// A step or another option that is wrong, an image with blank pixels, frames that do not fit together, or an error of the file system.
pub fn run(args: &EnhanceArgs, context: &Context) -> Result<Outcome> {
    let fits = &args.out.output;
    if fits.extension().is_some_and(|e| e.eq_ignore_ascii_case("png")) {
        return Err(Failure::usage(format!("-o {}: name the FITS file; the picture is written beside it as .png", fits.display())));
    }
    let options = args.options.clone().or(of_file(args.config.as_deref())?);
    let png = fits.with_extension("png");
    let inputs = args.images.iter().chain(&options.psf).chain(&options.truth).chain(&args.config);
    args.out.claim([fits].into_iter().chain((!args.no_png).then_some(&png)), inputs)?;
    let Some(steps) = &options.steps else { return Err(Failure::usage("give the steps, as --steps median=5,clahe or in a --config file")) };
    let psf = psf(steps, options.psf.as_deref())?;
    let images: Vec<Image> = args.images.iter().map(|path| open_image(path)).collect::<Result<_, _>>()?;
    let truth = options.truth.as_deref().map(open_image).transpose()?;
    let Some(first) = images.first() else { return Err(Failure::usage("enhance needs an image")) };
    if first.data.dim().0 * first.data.dim().1 > 1 && (truth.is_some() || options.target.is_some()) {
        context.console.warn("the image has several planes of channels and polarisations: only the first is measured");
    }
    let measure = Measure::new(first, options.target, truth.as_ref()).map_err(Failure::call)?;
    let what = || format!("enhancing {}{}", args.images[0].display(), if images.len() > 1 { " and its other frames" } else { "" });
    let mut after = enhance(&images, steps, psf.as_ref()).map_err(Failure::call).context(what())?;
    let measuring = || format!("comparing {} with its truth", args.images[0].display());
    let figures = [measure.metrics(first).context(measuring())?, measure.metrics(&after).context(measuring())?];
    let text = table(&figures, after.unit.bunit());
    let texts: Vec<String> = steps.texts().collect();
    let json = json!({
        "output": fits,
        "steps": texts,
        "n_frames": images.len(),
        "unit": after.unit.bunit(),
        "size": [after.grid.n_l, after.grid.n_m],
        "cell_rad": after.grid.cell_rad,
        "before": told(&figures[0]),
        "after": told(&figures[1]),
    });
    after.history.push(format!("steps {steps}"));
    args.out.image(fits, &mut after, context)?;
    let mut outcome = Outcome::new(json, text).wrote(fits);
    if !args.no_png {
        args.out.write(&png, &picture(first, &after, &texts.join(", "))?)?;
        outcome = outcome.wrote(png);
    }
    Ok(outcome)
}

/// The options of a file, whose paths start from its folder.
fn of_file(path: Option<&Path>) -> Result<EnhanceOptions> {
    let Some(path) = path else { return Ok(EnhanceOptions::default()) };
    let mut options: EnhanceOptions = numbers::read(&cittert_formats::read_text(path)?, path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for file in [&mut options.psf, &mut options.truth].into_iter().flatten() {
        *file = folder.join(&*file);
    }
    Ok(options)
}

fn psf(steps: &StepList, path: Option<&Path>) -> Result<Option<Psf>> {
    match (steps.needs_psf(), path) {
        (true, None) => Err(Failure::usage("a deconvolution needs the PSF of the sensor: give its FITS image as --psf")),
        (false, Some(path)) => {
            Err(Failure::usage(format!("--psf {}: no step uses a PSF; wiener-deconvolution and richardson-lucy do", path.display())))
        }
        (true, Some(path)) => Ok(Some(Psf::of(&open_image(path)?).context(path.display())?)),
        (false, None) => Ok(None),
    }
}

/// Before and after, side by side in the colours of the first.
fn picture(before: &Image, after: &Image, steps: &str) -> Result<Vec<u8>> {
    let options = ImagePlot { width: 2 * PICTURE.0, height: PICTURE.1, ..ImagePlot::default() };
    Ok(plot::images(&[(before, "before"), (after, &format!("after {steps}"))], &options)?.png()?)
}

fn told(m: &Metrics) -> Value {
    let mut json = json!({ "mean": m.mean, "noise": m.noise, "snr": m.snr });
    if let Some(edge) = &m.edge {
        (json["edge_width_rad"], json["edge_overshoot"], json["edge_step"]) =
            (edge.width_rad.into(), edge.overshoot.into(), edge.step.into());
    }
    if let Some(target) = &m.target {
        json["target_difference"] = target.difference.into();
        json["target_clutter"] = target.clutter.into();
        json["target_contrast"] = target.contrast.into();
    }
    if let Some(truth) = &m.truth {
        json["rms_difference"] = truth.rms_difference.into();
        json["error_over_grey_card"] = truth.error_over_grey_card.into();
        json["ssim"] = truth.ssim.into();
    }
    json
}

fn table(figures: &[Metrics; 2], unit: &str) -> String {
    let mut lines = vec![format!("{:24} {:>16} {:>16}", "", "before", "after")];
    let mut row = |name: &str, of: &dyn Fn(&Metrics) -> Option<String>| {
        if figures.iter().any(|m| of(m).is_some()) {
            let [before, after] = [0, 1].map(|k| of(&figures[k]).unwrap_or_else(|| "-".into()));
            lines.push(format!("{name:24} {before:>16} {after:>16}"));
        }
    };
    let value = |v: f64| Some(format!("{v:.4} {unit}").trim_end().to_owned());
    row("mean", &|m| value(m.mean));
    row("noise", &|m| value(m.noise));
    row("signal to noise", &|m| Some(format!("{:.2}", m.snr)));
    row("edge, 10 % to 90 %", &|m| m.edge.map(|e| angle(e.width_rad)));
    row("overshoot at edges", &|m| m.edge.map(|e| format!("{:.1} %", 100.0 * e.overshoot)));
    row("target over background", &|m| m.target.and_then(|t| value(t.difference)));
    row("target over clutter", &|m| m.target.map(|t| format!("{:.2}", t.contrast)));
    row("rms difference, truth", &|m| m.truth.and_then(|t| value(t.rms_difference)));
    row("SSIM", &|m| m.truth.map(|t| format!("{:.4}", t.ssim)));
    lines.join("\n")
}

/// Lines of an image that are enhanced first for a forecast.
const FIRST_LINES: usize = 64;

/// The first lines of an image.
fn lines(image: &Image, n: usize) -> Result<Image> {
    let grid = SkyGrid::new(image.grid.n_l, n, image.grid.cell_rad, image.grid.frame.clone())?;
    Ok(Image { grid, data: image.data.slice(s![.., .., ..n, ..]).to_owned(), ..image.clone() })
}

impl Plan for EnhanceArgs {
    fn plan(&self, planner: &Planner<'_>) -> Result<Told> {
        planner.alone("enhances an image")?;
        planner.no_visibilities("an image has none")?;
        let options = self.options.clone().or(of_file(self.config.as_deref())?);
        let Some(steps) = &options.steps else {
            return Err(Failure::usage("give the steps, as --steps median=5,clahe or in a --config file"));
        };
        let psf = psf(steps, options.psf.as_deref())?;
        let images: Vec<Image> = self.images.iter().map(|path| open_image(path)).collect::<Result<_, _>>()?;
        let Some(first) = images.first() else { return Err(Failure::usage("enhance needs an image")) };
        let mut written = 0;
        let found = grown((first.grid.n_m as f64, first.grid.n_m), FIRST_LINES, &mut |n| {
            let some: Vec<Image> = images.iter().map(|image| lines(image, n)).collect::<Result<_>>()?;
            let after = enhance(&some, steps, psf.as_ref()).map_err(Failure::call)?;
            let measure = Measure::new(&some[0], None, None).map_err(Failure::call)?;
            [&some[0], &after].into_iter().try_for_each(|image| measure.metrics(image).map(drop))?;
            written = after.data.len();
            Ok(())
        })?;
        let pixels = written as f64 * first.grid.n_m as f64 / found.part.max(1) as f64;
        let given: usize = images.iter().map(|image| image.data.len()).sum();
        let mut forecast = cost::timed("steps", (found.seconds, found.held_bytes), if self.no_png { 0.0 } else { 1.0 });
        let write = Stage::new("write", (given as f64 + 2.0 * pixels) * 8.0);
        forecast.stages.push(write.doing([(Term::WritePixel, pixels), (Term::PicturePixel, if self.no_png { 0.0 } else { 2.0 * pixels })]));
        forecast.output_bytes += 4.0 * pixels;
        forecast.assumptions.push(found.assumption("lines of the image"));
        let mut facts = Map::new();
        facts.insert("size".into(), json!([first.grid.n_l, first.grid.n_m]));
        facts.insert("frames".into(), images.len().into());
        Ok(Told { command: "enhance", forecast, facts })
    }

    fn output(&self) -> &Path {
        &self.out.output
    }
}
