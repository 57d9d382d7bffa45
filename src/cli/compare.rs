//! `compare`: the distance of an image, a gain table or pointings from the truth.

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::OutputArgs;
use super::text::angle;
use crate::calibrate::{CompareOptions as GainOptions, compare_gains};
use crate::fidelity::{CompareOptions, Comparison, Dimmed, Fidelity, Region, compare, fidelity_of_pixel};
use crate::plot::{self, ImagePlot, Range, Wish};
use cittert_arrays::quantity::Angle;
use cittert_arrays::{BrightnessUnit, Image, SkyGrid, SpectralWindow};
use cittert_formats::calh5::{is_gains, read_gains};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::is_pointings;
use cittert_formats::open_image as read_image;
use clap::Args;
use ndarray::Axis;
use std::path::{Path, PathBuf};

/// Options of `compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// The image (or gain table, or table of pointings) to judge.
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// The true image (or gain table, or table of pointings).
    #[arg(value_name = "TRUTH")]
    truth: PathBuf,
    /// Convolve the truth with the restoring beam of the image first.
    #[arg(long)]
    convolve: bool,
    /// Bring image and truth to a round beam of this full width at half maximum first, so that images of different beams compare alike.
    #[arg(long, value_name = "ANGLE", conflicts_with = "convolve")]
    resolution: Option<Angle>,
    /// Compare only inside a disc around the centre. Its radius is this fraction of the smaller side (0.5 touches the edge).
    #[arg(long, value_name = "FRACTION")]
    disc: Option<f64>,
    /// Shift the image onto the truth first. Self-calibration with a free model leaves the position of the image open.
    #[arg(long)]
    shift: bool,
    /// Write the image minus the truth, as FITS or as a PNG picture, by the ending of the name.
    #[arg(long, value_name = "FILE")]
    difference: Option<PathBuf>,
    /// Write the fidelity of each pixel, |truth| / |image - truth|, as FITS.
    #[arg(long, value_name = "FITS")]
    fidelity: Option<PathBuf>,
    /// Replace an output that exists.
    #[arg(long)]
    overwrite: bool,
    /// For gain tables: remove a phase gradient over the array, which is a shift of the image.
    #[arg(long)]
    gradient: bool,
    /// For gain tables: remove one amplitude scale, which is the flux scale of the model.
    #[arg(long)]
    flux_scale: bool,
}

/// Compare two images, or two gain tables. A truth on another grid is regridded onto that of the image.
///
/// # Errors
/// Files that are neither images nor gain tables, one of each, images without a common sky, antennas that do not match, a missing beam.
pub fn run(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    match (is_pointings(&args.image), is_pointings(&args.truth)) {
        (true, true) => return super::compare_pointings::compare(&args.image, &args.truth),
        (false, false) => {}
        (one, _) => {
            let (table, other) = if one { (&args.image, &args.truth) } else { (&args.truth, &args.image) };
            let text = format!("{} is a table of pointings and {} is not: give two tables of pointings", table.display(), other.display());
            return Err(Failure::message(text));
        }
    }
    match (is_gains(&args.image), is_gains(&args.truth)) {
        (true, true) => gains(args),
        (false, false) => images(args, context),
        (one, _) => {
            let (gains, other) = if one { (&args.image, &args.truth) } else { (&args.truth, &args.image) };
            Err(Failure::message(format!(
                "{} is a gain table and {} is not: give two gain tables, or two images",
                gains.display(),
                other.display()
            )))
        }
    }
}

fn gains(args: &CompareArgs) -> Result<Outcome> {
    if args.convolve
        || args.resolution.is_some()
        || args.shift
        || args.disc.is_some()
        || args.difference.is_some()
        || args.fidelity.is_some()
    {
        let options = "--convolve, --resolution, --disc, --shift, --difference and --fidelity";
        return Err(Failure::usage(format!("{options} are for images; gain tables take --gradient and --flux-scale")));
    }
    let (found, truth) = (read_gains(&args.image)?, read_gains(&args.truth)?);
    let options = GainOptions { gradient: args.gradient, flux_scale: args.flux_scale };
    let what = format!("comparing {} with {}", args.image.display(), args.truth.display());
    let c = compare_gains(&found, &truth, options).context(what)?;
    let mut json = serde_json::json!({
        "max_abs_phase_rad": c.max_abs_phase_rad, "rms_phase_rad": c.rms_phase_rad, "rms_amplitude": c.rms_amplitude,
        "amplitude_scale": c.amplitude_scale, "n_compared": c.compared, "n_flagged": c.flagged,
        "removed": { "common_phase": true, "gradient": args.gradient, "flux_scale": args.flux_scale },
    });
    let mut text = format!(
        "phase difference  rms {:.4e} rad, largest {:.4e} rad\namplitudes        rms {:.4e} (scale {:.5})\ngains             {} compared, {} flagged or missing in the other table",
        c.rms_phase_rad, c.max_abs_phase_rad, c.rms_amplitude, c.amplitude_scale, c.compared, c.flagged
    );
    if let Some((l, m)) = c.shift_rad {
        (json["shift_l_rad"], json["shift_m_rad"]) = (l.into(), m.into());
        text += &format!("\nimage shift       l {}, m {}", angle(l), angle(m));
    }
    Ok(Outcome::new(json, text))
}

fn images(args: &CompareArgs, context: &Context) -> Result<Outcome> {
    if args.gradient || args.flux_scale {
        return Err(Failure::usage("--gradient and --flux-scale are for gain tables; images take --shift"));
    }
    let outputs = args.outputs()?;
    let (image, truth) = (read_image(&args.image)?, read_image(&args.truth)?);
    let names = (args.image.display(), args.truth.display());
    let beam = match (args.convolve, image.beams.first()) {
        (false, _) => None,
        (true, Some(beam)) => Some(*beam),
        (true, None) => {
            return Err(Failure::message(format!("{}: it has no restoring beam (BMAJ, BMIN, BPA), which --convolve needs", names.0)));
        }
    };
    let region = args.disc.map_or(Region::All, |radius| Region::Disc { radius });
    let options = CompareOptions { region, beam, resolution_rad: args.resolution.map(Angle::si), shift: args.shift };
    let found = compare(&image, &truth, &options).context(format!("comparing {} with {}", names.0, names.1))?;
    warn(&image, &truth, &found, context);
    let (mut json, mut text) = (serde_json::to_value(found.scores)?, scores(&found.scores, image.unit.bunit()));
    json["unit"] = image.unit.bunit().into();
    (json["n_compared"], json["n_blank"]) = (found.n_compared.into(), found.n_blank.into());
    if let Some(field) = &found.field {
        (json["field"], json["field"]["n_compared"]) = (serde_json::to_value(field.scores)?, field.n_compared.into());
        let share = 100.0 * field.n_compared as f64 / found.n_compared as f64;
        text += &format!(
            "\nWithin half power of the elements ({share:.0} % of the pixels), outside of which they see little of the scene:\n{}",
            scores(&field.scores, image.unit.bunit())
        );
    }
    for line in steps(&image, &found, &mut json) {
        text += &format!("\n{line}");
    }
    let mut outcome = Outcome::new(json, text);
    for (path, kind) in &outputs {
        write(args, path, *kind, &image, &found, context)?;
        outcome = outcome.wrote(path);
    }
    Ok(outcome)
}

fn scores(f: &Fidelity, unit: &str) -> String {
    let rows = [
        ("rms difference", format!("{:.4e} {unit}", f.rms_difference)),
        ("NRMSE", format!("{:.5}", f.nrmse)),
        ("error over grey card", format!("{:.5} (0 is perfect, 1 is no better than a flat grey card)", f.error_over_grey_card)),
        ("peak over robust rms", format!("{:.1}", f.peak_over_robust_rms)),
        ("fidelity index", format!("{:.2}", f.fidelity)),
        ("SSIM", format!("{:.5}", f.ssim)),
        ("peak ratio", format!("{:.5}", f.peak_ratio)),
        ("flux ratio", format!("{:.5}", f.flux_ratio)),
    ];
    rows.map(|(name, value)| format!("{name:21} {value}")).join("\n")
}

/// What was done to the images before they were compared, as lines and as JSON.
fn steps(image: &Image, found: &Comparison, json: &mut serde_json::Value) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(from) = &found.regridded_from {
        let size = |g: &SkyGrid| format!("{} x {} pixels of {}", g.n_l, g.n_m, angle(g.cell_rad));
        lines.push(format!("The truth was regridded from {} to {}.", size(from), size(&image.grid)));
        json["regridded_from"] = serde_json::json!({ "size": [from.n_l, from.n_m], "cell_rad": from.cell_rad });
    }
    if let Some(dimmed) = found.dimmed {
        let (one, other) = if dimmed == Dimmed::Image { ("image", "truth") } else { ("truth", "image") };
        lines.push(format!("The {one} was multiplied by the pattern of the elements, which the {other} contains."));
        json["dimmed"] = one.into();
    }
    if let Some(from) = found.converted_from {
        lines.push(format!("The truth was converted from {} to {}.", from.bunit(), image.unit.bunit()));
        json["converted_from"] = from.bunit().into();
    }
    if found.n_blank > 0 {
        let all = found.n_blank + found.n_compared;
        lines.push(format!("{} of {all} pixels were left out: they are blank, or have no truth.", found.n_blank));
    }
    if let Some((l, m)) = found.shift_rad {
        (json["shift_l_rad"], json["shift_m_rad"]) = (l.into(), m.into());
        lines.push(format!("The image was shifted by l {}, m {}.", angle(l), angle(m)));
    }
    lines
}

fn warn(image: &Image, truth: &Image, found: &Comparison, context: &Context) {
    if image.unit != truth.unit && found.converted_from.is_none() {
        let name = |unit: BrightnessUnit| if unit.bunit().is_empty() { "no known unit" } else { unit.bunit() };
        let (one, other) = (name(image.unit), name(truth.unit));
        context.console.warn(&format!("the image has {one} and the truth {other}: the numbers are compared as they are"));
    }
    for (what, planes) in [("image", &image.data), ("truth", &truth.data)] {
        let n = planes.dim().0 * planes.dim().1;
        if n > 1 {
            context.console.warn(&format!("the {what} has {n} planes of channels and polarisations: only the first is compared"));
        }
    }
}

/// A picture or an image that `compare` writes.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Difference,
    Fidelity,
}

fn is_png(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("png"))
}

impl CompareArgs {
    /// The images to write, after a check that they can be written.
    fn outputs(&self) -> Result<Vec<(&Path, Kind)>> {
        let all = [(&self.difference, Kind::Difference), (&self.fidelity, Kind::Fidelity)];
        let wanted: Vec<(&Path, Kind)> = all.into_iter().filter_map(|(path, kind)| Some((path.as_deref()?, kind))).collect();
        for (path, kind) in &wanted {
            let fits = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("fits"));
            if !(fits || is_png(path) && *kind == Kind::Difference) {
                let (option, endings) = if *kind == Kind::Difference { ("difference", ".fits or .png") } else { ("fidelity", ".fits") };
                return Err(Failure::usage(format!("--{option} {}: the name must end in {endings}", path.display())));
            }
        }
        let paths = wanted.iter().map(|(path, _)| path);
        self.out(Path::new("")).claim(paths, [&self.image, &self.truth])?;
        Ok(wanted)
    }

    fn out(&self, path: &Path) -> OutputArgs {
        OutputArgs { output: path.into(), overwrite: self.overwrite }
    }
}

fn write(args: &CompareArgs, path: &Path, kind: Kind, image: &Image, found: &Comparison, context: &Context) -> Result<()> {
    let (plane, unit) = match kind {
        Kind::Difference => (&found.image - &found.truth, image.unit),
        Kind::Fidelity => (fidelity_of_pixel(found.image.view(), found.truth.view())?, BrightnessUnit::One),
    };
    let spectrum = &image.spectrum;
    let band = SpectralWindow::new(spectrum.freq_hz()[..1].to_vec(), spectrum.width_hz()[..1].to_vec())?;
    let data = plane.insert_axis(Axis(0)).insert_axis(Axis(0));
    let mut out = Image::new(image.grid.clone(), band, image.polarizations[..1].to_vec(), data, unit)?;
    out.object.clone_from(&image.object);
    if is_png(path) {
        let title = format!("{} minus {}", args.image.display(), args.truth.display());
        let drawn =
            plot::image(&out, &ImagePlot { title, wish: Wish { range: Range::Symmetric, ..Wish::default() }, ..ImagePlot::default() })?
                .png()?;
        return args.out(path).write(path, &drawn);
    }
    out.history.push(context.history());
    Ok(write_image(path, &out, ImageOptions { overwrite: args.overwrite, ..ImageOptions::default() })?)
}
