//! Pictures of a sensor, and its page.

use super::results::Results;
use crate::cli::failure::Result;
use crate::plot::report::{Figure, Report, Section, Table, page as html};
use crate::plot::{self, CurveOptions, ImagePlot, Range, Series, Stretch, View, Wish};
use cittert_arrays::{BrightnessUnit, Image, SkyGrid};
use ndarray::s;
use std::path::Path;

/// Image, PSF, noise and modulation as PNG, in the order of their files.
pub(super) fn pictures(results: &Results<'_>) -> Result<[Vec<u8>; 4]> {
    let titled = |title: &str| ImagePlot { title: title.to_owned(), ..ImagePlot::default() };
    let image = plot::image(&results.image, &titled("Image of the sensor"))?.png()?;
    let psf = psf_in_db(results)?;
    let nedt = plot::image(&results.nedt, &titled("Standard deviation of the noise"))?.png()?;
    Ok([image, psf, nedt, modulation(results)?])
}

/// Lowest level of the picture of the PSF, dB.
const LOWEST_DB: f64 = -40.0;

/// The middle of the PSF in dB below its peak. Aberrations may put the peak beside the middle.
fn psf_in_db(results: &Results<'_>) -> Result<Vec<u8>> {
    let (psf, [_, width]) = (&results.psf, results.sensor.widths_rad());
    let n = psf.grid.n_l;
    let half = ((6.0 * width[0].max(width[1]) / psf.grid.cell_rad).ceil() as usize).clamp(n.min(16) / 2, n / 2);
    let peak = psf.data.iter().fold(0.0_f64, |a, v| a.max(*v));
    let middle = psf.data.slice(s![.., .., n / 2 - half..n / 2 + half, n / 2 - half..n / 2 + half]);
    let levels = middle.mapv(|v| (10.0 * (v / peak).log10()).max(LOWEST_DB));
    let grid = SkyGrid::new(2 * half, 2 * half, psf.grid.cell_rad, psf.grid.frame.clone())?;
    let shown = Image::new(grid, psf.spectrum.clone(), psf.polarizations.clone(), levels, BrightnessUnit::One)?;
    let wish = Wish { range: Range::Fixed(LOWEST_DB, 0.0), stretch: Stretch::Linear, full: true };
    let options = ImagePlot { title: "PSF of the sensor\nin dB below its peak".into(), wish, ..ImagePlot::default() };
    Ok(plot::image(&shown, &options)?.png()?)
}

fn modulation(results: &Results<'_>) -> Result<Vec<u8>> {
    let all = results.modulation();
    let line = |name: &str, of: &dyn Fn(&crate::sensor::Modulation) -> f64| Series {
        name: name.to_owned(),
        points: all.iter().map(|m| (m.frequency * 1e-3, of(m))).collect(),
        ..Series::default()
    };
    let series = [
        line("optics, along l", &|m| m.optics[0]),
        line("optics, along m", &|m| m.optics[1]),
        line("all, along l", &|m| m.total()[0]),
        line("all, along m", &|m| m.total()[1]),
    ];
    let options = CurveOptions {
        title: "Modulation transfer function".into(),
        x_label: "spatial frequency, cycles/mrad".into(),
        y_label: "modulation".into(),
        markers: false,
        ..CurveOptions::default()
    };
    Ok(plot::curves(&series, &options)?.png()?)
}

/// The page: the image, the scene, the image of the other instrument, and what the sensor is like.
pub(super) fn page(
    results: &Results<'_>,
    pictures: &[Vec<u8>; 4],
    names: &[String; 5],
    scene: &Image,
    beside: Option<(&Path, &Image)>,
    command: &str,
) -> Result<String> {
    // All in the colours of the scene, so that they can be compared.
    let view = View::new(scene, 0, 0, &Wish { full: true, ..Wish::default() })?;
    let shown = |image: &Image, title: &str, caption: String| -> Result<Figure> {
        let options = ImagePlot { title: title.to_owned(), view: Some(view.clone()), ..ImagePlot::default() };
        Ok(Figure { png: plot::image(image, &options)?.png()?, caption, file: String::new() })
    };
    let mut highlights = vec![
        shown(scene, "Scene", "The scene.".into())?,
        shown(&results.image, "Filled aperture", format!("The image of the sensor, with noise of {:.3} K.", results.nedt_k()))?,
    ];
    let mut verdict = vec![format!(
        "The image of the sensor differs from the truth by {:.3} K rms; {:.3} K are noise, and the rest is detail that the aperture and the samples do not pass.",
        results.own.rms_difference,
        results.nedt_k()
    )];
    if let (Some((path, image)), Some(other)) = (beside, &results.other) {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        highlights.push(shown(image, "Beside", format!("{name}, in the same colours."))?);
        let better = if other.rms_difference < results.own.rms_difference { &*name } else { "the sensor" };
        verdict
            .push(format!("{name} differs from it by {:.3} K rms. By this score, {better} is nearer to the truth.", other.rms_difference));
    }
    let scores = Table {
        head: ["", "sensor", if beside.is_some() { "beside" } else { "" }].map(str::to_owned).to_vec(),
        rows: results.score_rows().into_iter().map(|(name, own, other)| vec![name.to_owned(), own, other]).collect(),
    };
    let figures = Table { head: Vec::new(), rows: results.rows().into_iter().map(|(name, value)| vec![name, value]).collect() };
    let picture = |k: usize, caption: &str| Figure { png: pictures[k].clone(), caption: caption.to_owned(), file: names[k].clone() };
    let report = Report {
        title: "Filled-aperture sensor".into(),
        verdict,
        highlights,
        sections: vec![
            Section {
                title: "Scores".into(),
                text: "Distances from the truth, on the pixels of each image.".into(),
                table: scores,
                ..Section::default()
            },
            Section {
                title: "Sensor".into(),
                text: "Resolution, sampling and noise.".into(),
                figures: vec![
                    picture(1, "PSF with the footprint of a detector and the motion in a sample."),
                    picture(3, "Modulation transfer functions of the optics and of all together."),
                    picture(2, "Expected standard deviation of the noise of each pixel."),
                ],
                table: figures,
                commands: vec![command.to_owned()],
                ..Section::default()
            },
        ],
        facts: vec![("version".into(), env!("CARGO_PKG_VERSION").into()), ("command".into(), command.to_owned())],
        ..Report::default()
    };
    Ok(html(&report))
}
