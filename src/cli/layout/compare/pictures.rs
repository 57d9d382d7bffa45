//! The pictures of a comparison. All pictures of one kind have the same colours.

use super::args::CompareArgs;
use super::design::Design;
use super::steps::{IMAGES, Made, TRUTH, error_file};
use crate::cli::failure::{Context as _, Result};
use crate::cli::layout::figures::range;
use crate::cli::layout::ghosts::{LEVEL_DB, in_words};
use crate::cli::picture::layout_title;
use crate::plot::report::Figure;
use crate::plot::{self, ImagePlot, Picture, Range, View, Wish, uv_coverage};
use cittert_arrays::{CoveragePlan, Image, SpectralWindow};
use cittert_formats::open_image;
use std::path::Path;

/// Width and height of a picture, pixels. They stand side by side on the page.
const SIZE: (usize, usize) = (640, 600);
/// Height of the picture of a dirty beam with its profile, pixels.
const BEAM_HEIGHT: usize = 760;
/// Julian date of the coverage. It only fills the time column: the baselines are those of the layout.
const ANY_DATE_JD: f64 = 2_460_677.0;

/// The pictures of one section of the page, in the order of the layouts.
pub(super) struct Row {
    pub(super) title: String,
    pub(super) text: String,
    pub(super) figures: Vec<Figure>,
}

/// Write a picture into the folder of the comparison.
fn keep(folder: &Path, file: String, caption: String, picture: Picture) -> Result<Figure> {
    let png = picture.png()?;
    std::fs::write(folder.join(&file), &png).context(format!("writing {file}"))?;
    Ok(Figure { png, caption, file })
}

/// Elements, baselines and dirty beams.
pub(super) fn of_layouts(designs: &[Design], args: &CompareArgs, folder: &Path) -> Result<Vec<Row>> {
    let (width, height) = SIZE;
    let f = &args.figures;
    let freq = args.freq.si();
    let band = match f.bandwidth {
        Some(width) => SpectralWindow::band(freq, width.si(), f.channels)?,
        None => SpectralWindow::new(vec![freq], vec![freq])?,
    };
    let (mut places, mut coverages, mut beams, mut maps) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    for d in designs {
        let name = &d.name;
        let picture = plot::layout(&d.layout, &layout_title(&d.layout), width, height)?;
        places.push(keep(folder, format!("{name}/layout.png"), name.clone(), picture)?);
        let coverage = CoveragePlan::snapshot(&d.layout, ANY_DATE_JD, 1.0)?.coverage()?;
        let picture = uv_coverage(&coverage, &band, &format!("{name}\none integration"), width, height)?;
        coverages.push(keep(folder, format!("{name}/uv.png"), name.clone(), picture)?);
        let image = open_image(&folder.join(format!("{name}/psf.fits")))?;
        let options = ImagePlot { title: name.clone(), width, height: BEAM_HEIGHT, ..ImagePlot::default() };
        let caption = format!("{name}: peak side lobe {:.1} dB {}", d.figures.psl_within_db, range(&d.figures));
        beams.push(keep(folder, format!("{name}/psf.png"), caption, plot::psf(&image, &options)?)?);
        let map = d.layout.ghost_map(freq, f, None, LEVEL_DB)?;
        let caption = format!("{name}: {}", in_words(&map, LEVEL_DB));
        maps.push(keep(folder, format!("{name}/ghosts.png"), caption, plot::ghosts(&map, name, width, height)?)?);
    }
    let row = |title: &str, text: &str, figures| Row { title: title.into(), text: text.into(), figures };
    Ok(vec![
        row("Elements", "Each picture has a scale of its own, which its axes give.", places),
        row(
            "u-v coverage",
            "Baselines of one integration towards the zenith or boresight. Each picture has a scale of its own.",
            coverages,
        ),
        row(
            "Dirty beams",
            "All beams have the same pixels. Below each one, its largest value and rms against the distance from the peak.",
            beams,
        ),
        row(
            "Where ghosts lie",
            "The beam out to 2.5 times the distance of the nearest exact ghost, or as far as side lobes count where the spacings are not regular. Each \
             picture has a scale of its own.",
            maps,
        ),
    ])
}

/// The scene, and the images and errors of every layout.
/// `rule` tells how they are compared; none where the scene has no image.
pub(super) fn of_images(designs: &[Design], folder: &Path, rule: Option<String>) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    let truth = rule.is_some().then(|| open_image(&folder.join(TRUTH))).transpose()?;
    if let Some((image, rule)) = truth.as_ref().zip(rule.as_ref()) {
        let figure = keep(folder, "scene.png".into(), "The truth".into(), plot::image(image, &options(String::new(), None))?)?;
        let text = format!("The scene at the resolution of its pixels. {rule}");
        rows.push(Row { title: "Scene".into(), text, figures: vec![figure] });
    }
    for made in &IMAGES {
        rows.push(row(designs, folder, made, truth.as_ref())?);
        if rule.is_some() {
            rows.push(errors(designs, folder, made)?);
        }
    }
    Ok(rows)
}

fn options(title: String, view: Option<View>) -> ImagePlot {
    ImagePlot { title, view, width: SIZE.0, height: SIZE.1, ..ImagePlot::default() }
}

fn open_all(designs: &[Design], folder: &Path, file: &str) -> Result<Vec<Image>> {
    designs.iter().map(|d| Ok(open_image(&folder.join(&d.name).join(file))?)).collect()
}

/// The images of one kind, in the colours of the scene, or in those of the first one where the scene has another unit.
fn row(designs: &[Design], folder: &Path, made: &Made, truth: Option<&Image>) -> Result<Row> {
    let all = open_all(designs, folder, made.file)?;
    let of_truth = truth.filter(|t| all.iter().all(|image| image.unit == t.unit));
    let view = of_truth.or(all.first()).map(|image| View::new(image, 0, 0, &whole(Range::Auto))).transpose()?;
    let like = if of_truth.is_some() { "the scene" } else { designs.first().map_or("", |d| d.name.as_str()) };
    let figures = draw(designs, folder, &all, made.key, view.map(|v| v.like(like)))?;
    Ok(Row { title: made.title.into(), text: format!("All in the colours of {like}."), figures })
}

/// The error maps of one kind of images, in the colours of the map with the largest error.
fn errors(designs: &[Design], folder: &Path, made: &Made) -> Result<Row> {
    let all = open_all(designs, folder, &error_file(made))?;
    let power = |image: &Image| image.data.iter().filter(|v| v.is_finite()).map(|v| v * v).sum::<f64>();
    let worst = all.iter().zip(designs).max_by(|a, b| power(a.0).total_cmp(&power(b.0)));
    let view = worst.map(|(image, d)| View::new(image, 0, 0, &whole(Range::Symmetric)).map(|v| v.like(&d.name))).transpose()?;
    let figures = draw(designs, folder, &all, &format!("{}-error", made.key), view)?;
    let text = "Image minus truth, both at the common resolution, all in the same colours around zero.".into();
    Ok(Row { title: format!("Errors: {}", made.title.to_lowercase().replace("clean", "CLEAN")), text, figures })
}

/// All of the frame, so that the images of all layouts show the same part of it.
fn whole(range: Range) -> Wish {
    Wish { range, full: true, ..Wish::default() }
}

fn draw(designs: &[Design], folder: &Path, all: &[Image], what: &str, view: Option<View>) -> Result<Vec<Figure>> {
    let one = |(d, image): (&Design, &Image)| {
        let picture = plot::image(image, &options(d.name.clone(), view.clone()))?;
        keep(folder, format!("{}/{what}.png", d.name), d.name.clone(), picture)
    };
    designs.iter().zip(all).map(one).collect()
}

/// The names of all pictures, so that a file of somebody else is not replaced.
pub(super) fn names(designs: &[Design]) -> Vec<String> {
    let of = |d: &Design| {
        let images = IMAGES.iter().flat_map(|m| [m.key.to_owned(), format!("{}-error", m.key)]);
        let all = ["layout", "uv", "psf", "ghosts"].map(str::to_owned).into_iter().chain(images);
        all.map(|what| format!("{}/{what}.png", d.name)).collect::<Vec<_>>()
    };
    designs.iter().flat_map(of).chain(["scene.png".to_owned()]).collect()
}
