//! The study of the frame rate: its table and its picture.

use super::args::FilmArgs;
use super::cameras::{Scenery, psf};
use crate::cli::context::{Context, Outcome};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::display::{Aperture, ArrayImage, Interferometer, Marked, PanelKind, RateFigures, RateRow, RateStudy};
use crate::plot::{CurveOptions, Series, Style, curves};
use crate::progress::Observer;
use cittert_arrays::quantity::Duration;
use serde_json::json;
use std::cell::Cell;
use std::path::PathBuf;
use std::time::Instant;

/// A column of the table: its name, its name in the picture, and its value.
type Column = (&'static str, Option<&'static str>, fn(&RateRow) -> Option<f64>);

const COLUMNS: &[Column] = &[
    ("rate_hz", None, |r| Some(r.rate_hz)),
    ("dwell_s", None, |r| Some(r.dwell_s)),
    ("nedt_k", None, |r| Some(r.nedt_k)),
    ("noise_k", None, |r| Some(r.noise_k)),
    ("snr", Some("signal to noise"), |r| Some(r.snr)),
    ("blur_px", Some("motion blur, pixels"), |r| Some(r.blur_pixels)),
    ("blur_rad", None, |r| Some(r.blur_rad)),
    ("target_difference_k", None, |r| r.target_difference_k),
    ("target_contrast", Some("target over clutter and noise"), |r| r.target_contrast),
    ("error_k", Some("rms error, K"), |r| Some(r.error_k)),
    ("pictures", None, |r| Some(r.pictures as f64)),
];

/// Whether the interferometer is studied, and not the filled aperture.
///
/// # Errors
/// Other panels, or options that do not act on what is studied.
fn of_array(args: &FilmArgs) -> Result<bool> {
    let array = match args.film.show.as_slice() {
        [PanelKind::Filled] => false,
        [PanelKind::Array] => true,
        _ => return Err(Failure::usage("--show names what --rates studies: filled or array")),
    };
    let idle = !array && args.film.array_image != ArrayImage::default();
    ensure!(!idle, Failure::usage("--array-image is the image of the interferometer: --rates studies it with --show array"));
    let steps = array && args.camera.steps.is_some();
    ensure!(!steps, Failure::usage("--steps work on the filled aperture alone; leave them out with --show array"));
    let silent = array && args.array.array_without_noise;
    ensure!(!silent, Failure::usage("a study of the frame rate needs noise: leave out --array-without-noise"));
    Ok(array)
}

/// A study of frame rates, and what it found.
pub(super) struct Studied {
    pub(super) figures: RateFigures,
    /// Pictures of the scene that were made, and the time that they took, s.
    pub(super) stills: (usize, f64),
    at_s: f64,
    /// Name of the scene.
    name: String,
}

/// Look at the scene at these rates with so many frames of each. `claim` gets the file of the scene before the work.
///
/// # Errors
/// A path, a scene or an option that is wrong.
pub(super) fn studied(
    args: &FilmArgs,
    (rates_hz, seeds): (Vec<f64>, usize),
    claim: &dyn Fn(&PathBuf) -> Result<()>,
    context: &Context,
    observer: &dyn Observer,
) -> Result<Studied> {
    let of_array = of_array(args)?;
    let (flight, scene) = args.flight.read("film")?;
    claim(&scene)?;
    let psf = psf(args)?;
    let flown = args.flight.open(flight, &scene, true, context)?;
    let (start, length) = (flown.flight.key.first().map_or(0.0, |key| key.time_s), flown.flight.duration_s());
    let at_s = args.rates.at.map_or(start + 0.5 * length, Duration::si);
    let inside = (start..=start + length).contains(&at_s);
    ensure!(inside, Failure::usage(format!("--at is {at_s} s, expected a time on the path: {start} s to {} s", start + length)));
    let scenery = Scenery::new(&flown, args)?;
    let array = scenery.interferometer(args, 1.0)?;
    ensure!(
        of_array || scenery.has_noise(args),
        Failure::usage("a study of the frame rate needs noise: give --tsys, or a --sensor with noise")
    );
    let target = match (&args.rates.target, &args.rates.target_surface) {
        (disc, Some(name)) => Some(scenery.marked(name, disc.as_ref(), at_s)?),
        (Some(disc), None) => Some(Marked::Disc(*disc)),
        (None, None) => None,
    };
    let (seed, steps) = (args.camera.seed, args.camera.steps.as_ref());
    let study = RateStudy { rates_hz, at_s, seeds, seed, target, steps, psf: psf.as_ref() };
    let camera = |rate: f64| match &array {
        Some(array) => Aperture::of_interferometer(Interferometer::at_rate(array, rate)?),
        None => scenery.aperture(args, rate),
    };
    let stills = Cell::new((0, 0.0));
    let still = |t: f64| {
        let started = Instant::now();
        let picture = scenery.at(t);
        stills.set((stills.get().0 + 1, stills.get().1 + started.elapsed().as_secs_f64()));
        picture
    };
    let figures = study.run(&still, &camera, observer).map_err(Failure::call).context(args.flight.path.display())?;
    Ok(Studied { figures, stills: stills.get(), at_s, name: flown.name().to_owned() })
}

/// The table of a study, and its picture.
///
/// # Errors
/// The output is no table.
pub(super) fn outputs(args: &FilmArgs) -> Result<[PathBuf; 2]> {
    let csv = &args.out.output;
    let named = csv.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv"));
    ensure!(
        named,
        Failure::usage(format!("-o {}: with --rates, name a table (.csv); its picture is written beside it as .png", csv.display()))
    );
    Ok([csv.clone(), csv.with_extension("png")])
}

/// Study the frame rate.
///
/// # Errors
/// A path, a scene or an option that is wrong, or an error of the file system.
pub(super) fn run(args: &FilmArgs, context: &Context) -> Result<Outcome> {
    let [csv, png] = &outputs(args)?;
    let claim = |scene: &PathBuf| args.out.claim([csv, png], args.inputs(scene));
    let found = studied(args, (args.rates.rates.clone(), args.rates.seeds), &claim, context, &context.console)?;
    let Studied { figures, at_s, name, .. } = found;
    let best = &figures.rows[figures.best];
    args.out.write(csv, table(&figures.rows).as_bytes())?;
    args.out.write(png, &picture(&figures, &name)?)?;
    let rows: Vec<_> =
        figures.rows.iter().map(|row| COLUMNS.iter().map(|c| (c.0, (c.2)(row))).collect::<std::collections::BTreeMap<_, _>>()).collect();
    let json = json!({
        "output": csv, "scene": name, "studied": args.film.show[0].caption(), "at_s": at_s, "speed_px_s": figures.speed_pixels_s, "seeds": args.rates.seeds, "seed": args.camera.seed,
        "best_rate_hz": best.rate_hz, "best_by": by(best), "rates": rows,
    });
    Ok(Outcome::new(json, text(&figures)).wrote(csv).wrote(png))
}

/// What the best rate is best in.
fn by(row: &RateRow) -> &'static str {
    if row.target_contrast.is_some() { "contrast of the target" } else { "rms error" }
}

fn table(rows: &[RateRow]) -> String {
    let mut text = COLUMNS.iter().map(|c| c.0).collect::<Vec<_>>().join(",") + "\n";
    for row in rows {
        let values = COLUMNS.iter().map(|c| (c.2)(row).map_or(String::new(), |v| v.to_string()));
        text += &(values.collect::<Vec<_>>().join(",") + "\n");
    }
    text
}

fn picture(figures: &RateFigures, name: &str) -> Result<Vec<u8>> {
    let points = |value: fn(&RateRow) -> Option<f64>| figures.rows.iter().filter_map(|r| Some((r.rate_hz, value(r)?))).collect::<Vec<_>>();
    let shown = COLUMNS.iter().filter_map(|(_, label, value)| Some((label.as_ref()?, points(*value))));
    let mut series: Vec<Series> = shown
        .filter(|(_, points)| points.iter().any(|p| p.1 > 0.0 && p.1.is_finite()))
        .map(|(label, points)| Series { name: (*label).to_owned(), points, errors: Vec::new() })
        .collect();
    let best = &figures.rows[figures.best];
    let heights = || series.iter().flat_map(|s| &s.points).map(|p| p.1).filter(|y| *y > 0.0 && y.is_finite());
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(0.0, f64::max));
    let mut styles: Vec<Style> = (0..series.len()).map(|color| Style { color, line: true, dots: true }).collect();
    series.push(Series {
        name: format!("best by {}", by(best)),
        points: vec![(best.rate_hz, low), (best.rate_hz, high)],
        errors: Vec::new(),
    });
    styles.push(Style { color: 6, line: true, dots: false });
    let options = CurveOptions {
        title: format!("{name}: frame rate"),
        x_label: "frames per second".into(),
        y_label: "value, in the unit of the legend".into(),
        log_x: true,
        log_y: true,
        styles,
        ..CurveOptions::default()
    };
    Ok(curves(&series, &options)?.png()?)
}

fn text(figures: &RateFigures) -> String {
    let mut lines =
        vec![format!("{:>10} {:>10} {:>10} {:>10} {:>12} {:>10} {:>10}", "rate", "NEDT", "noise", "SNR", "blur", "contrast", "rms error")];
    for row in &figures.rows {
        let contrast = row.target_contrast.map_or("-".into(), |c| format!("{c:.2}"));
        lines.push(format!(
            "{:>7} /s {:>8.3} K {:>8.3} K {:>10.2} {:>9.2} px {contrast:>10} {:>8.3} K",
            row.rate_hz, row.nedt_k, row.noise_k, row.snr, row.blur_pixels, row.error_k
        ));
    }
    let best = &figures.rows[figures.best];
    lines.push(format!("best by {}: {} frames per second", by(best), best.rate_hz));
    lines.join("\n")
}
