//! `sensor`: a scene through a filled-aperture sensor.

mod page;
mod results;
mod tables;

use super::context::{Context, Outcome};
use super::failure::{Context as _, Failure, Result};
use super::options::{Given, OutputArgs};
use crate::fidelity::{CompareOptions, Fidelity, compare};
use crate::sensor::{Sensor, SensorOptions};
use cittert_arrays::Image;
use cittert_formats::open_image;
use clap::Args;
use results::Results;
use std::path::{Path, PathBuf};

/// Options of `sensor`.
#[derive(Debug, Args)]
#[command(after_help = tables::help())]
pub struct SensorArgs {
    /// The scene in kelvin, FITS.
    #[arg(value_name = "IMAGE")]
    image: PathBuf,
    /// File with the options in tables [pupil], [aberrations], [band], [scan] and [noise], as TOML; options of the command line replace its own.
    #[arg(long, value_name = "TOML")]
    config: Option<PathBuf>,
    #[command(flatten)]
    options: Given<SensorOptions>,
    /// Image of another instrument in kelvin, such as an interferometer of the same aperture and time, to stand beside this one in the report.
    #[arg(long, value_name = "FITS")]
    beside: Option<PathBuf>,
    /// True image for the scores [default: the scene].
    #[arg(long, value_name = "FITS")]
    truth: Option<PathBuf>,
    /// Write no pictures and no report.
    #[arg(long)]
    no_png: bool,
    #[command(flatten)]
    out: OutputArgs,
}

/// Endings of the files; the first ones are always written.
const DATA: [&str; 5] = ["-image.fits", "-psf.fits", "-nedt.fits", "-mtf.csv", "-ensquared.csv"];
const PICTURES: [&str; 5] = ["-image.png", "-psf.png", "-nedt.png", "-mtf.png", "-report.html"];

/// See a scene through a sensor, and write image, PSF, noise and figures.
///
/// # Errors
/// An option that is wrong, a scene that is not in kelvin or has blank pixels, or an error of the file system.
pub fn run(args: &SensorArgs, context: &Context) -> Result<Outcome> {
    let mut options = args.options.over(args.config.as_deref())?;
    let mask = mask_path(args, &options);
    let endings = if args.no_png { &DATA[..] } else { &[DATA, PICTURES].concat() };
    let inputs = [Some(&args.image), args.config.as_ref(), args.beside.as_ref(), args.truth.as_ref(), mask.as_ref()];
    args.out.claim(args.out.all_suffixed(endings), inputs.into_iter().flatten())?;
    if let Some(path) = &mask {
        options.pupil.mask = Some(open_image(path)?.plane(0, 0).to_owned());
    }
    let scene = open_image(&args.image)?;
    let wrong = || args.config.as_ref().map_or(args.image.display().to_string(), |c| c.display().to_string());
    let sensor =
        Sensor::new(&options, &scene.grid, &scene.spectrum).map_err(Failure::call).context(format!("making the sensor of {}", wrong()));
    let sensor = sensor?;
    let seeing = || format!("seeing {}", args.image.display());
    let image = sensor.frame(&scene, &mut sensor.begin(options.noise.seed)).map_err(Failure::call).context(seeing())?;
    let nedt = sensor.nedt(&scene).context(seeing())?;
    let truth = args.truth.as_deref().map(open_image).transpose()?;
    let truth = truth.as_ref().unwrap_or(&scene);
    let beside = args.beside.as_deref().map(|path| Ok::<_, Failure>((path, open_image(path)?))).transpose()?;
    let score = |image: &Image, path: &Path| -> Result<Fidelity> {
        Ok(compare(image, truth, &CompareOptions::default()).context(format!("comparing {} with the truth", path.display()))?.scores)
    };
    let own = score(&image, &args.out.suffixed(DATA[0]))?;
    let other = beside.as_ref().map(|(path, image)| score(image, path)).transpose()?;
    let parts = sensor.noise_parts(&scene)?;
    let results = Results { sensor: &sensor, parts, psf: sensor.psf()?, image, nedt, own, other };
    note_coarse(&sensor, &scene, context);
    if results.parts.is_empty() {
        context.console.note("the image has no noise: give --tsys or --receiver");
    }
    write(args, context, &options, &scene, beside.as_ref().map(|(path, image)| (*path, image)), results)
}

/// The mask of the aperture. In a file it is a path from the folder of the file.
fn mask_path(args: &SensorArgs, options: &SensorOptions) -> Option<PathBuf> {
    let path = options.pupil.aperture_mask.as_ref()?;
    let typed = args.options.has("aperture_mask");
    let folder = args.config.as_deref().filter(|_| !typed).and_then(Path::parent);
    Some(folder.unwrap_or(Path::new("")).join(path))
}

/// A sensor that resolves the pixels of the scene shows these and not the scene.
fn note_coarse(sensor: &Sensor, scene: &Image, context: &Context) {
    let at_edge = sensor.modulation_at(0.5 / scene.grid.cell_rad).total().into_iter().fold(0.0, f64::max);
    if at_edge > 0.1 {
        context.console.warn(&format!(
            "the sensor passes {:.0} % of the finest detail that the pixels of the scene can show: a scene with smaller pixels has more of it",
            100.0 * at_edge
        ));
    }
}

fn write(
    args: &SensorArgs,
    context: &Context,
    options: &SensorOptions,
    scene: &Image,
    beside: Option<(&Path, &Image)>,
    mut results: Results<'_>,
) -> Result<Outcome> {
    let path = |ending: &str| args.out.suffixed(ending);
    let told = serde_json::to_string(options).map_err(|e| Failure::message(e.to_string()))?;
    let mut outcome = Outcome::new(results.json(&args.out.output), results.text());
    for (ending, image) in [(DATA[0], &mut results.image), (DATA[1], &mut results.psf), (DATA[2], &mut results.nedt)] {
        image.history.push(format!("sensor {told}"));
        args.out.image(&path(ending), image, context)?;
        outcome = outcome.wrote(path(ending));
    }
    for (ending, text) in [(DATA[3], results.mtf_csv()), (DATA[4], results.ensquared_csv())] {
        args.out.write(&path(ending), text.as_bytes())?;
        outcome = outcome.wrote(path(ending));
    }
    if !args.no_png {
        let names = PICTURES.map(|ending| path(ending).file_name().unwrap_or_default().to_string_lossy().into_owned());
        let pictures = page::pictures(&results)?;
        for (png, ending) in pictures.iter().zip(PICTURES) {
            args.out.write(&path(ending), png)?;
            outcome = outcome.wrote(path(ending));
        }
        let page = page::page(&results, &pictures, &names, scene, beside, &context.command_line)?;
        args.out.write(&path(PICTURES[4]), page.as_bytes())?;
        outcome = outcome.wrote(path(PICTURES[4]));
    }
    Ok(outcome)
}
