//! What all images of a comparison share, so that they are judged alike: one resolution, and the truth that each of them can show.

use super::args::CompareArgs;
use super::design::Design;
use super::steps::{IMAGES, TRUTH, scene_file};
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::run::labels::angle;
use crate::simulate::{Element, ElementPattern, SimulateOptions};
use cittert_formats::fits::{ImageOptions, write_image};
use cittert_formats::open_image;
use std::path::Path;

/// The common beam is wider than the coarsest of all images by this factor, so that the pixels can hold the Gaussian that it still lacks.
const WIDER: f64 = 1.1;
/// Widest common beam, over the shorter side of the images.
const WIDEST: f64 = 0.25;

/// The round beam to which all images and their truth are brought, rad: 1.1 times the coarsest beam of them.
///
/// # Errors
/// That beam is so wide that the images show nothing.
pub(super) fn resolution_rad(designs: &[Design], folder: &Path) -> Result<f64> {
    let (mut coarsest, mut frame) = ((0.0, ""), f64::INFINITY);
    for d in designs {
        for made in &IMAGES {
            let image = open_image(&folder.join(&d.name).join(made.file))?;
            frame = frame.min(image.grid.cell_rad * image.grid.n_l.min(image.grid.n_m) as f64);
            if let Some(beam) = image.beams.first().filter(|b| b.bmaj_rad > coarsest.0) {
                coarsest = (beam.bmaj_rad, d.name.as_str());
            }
        }
    }
    let (beam, name) = coarsest;
    ensure!(
        beam < WIDEST * frame,
        Failure::message(format!(
            "images are compared at the resolution of the coarsest beam, and that of {name}, {}, is more than a quarter of their width of {}: leave this \
             layout out, or give a larger --size",
            angle(beam),
            angle(frame)
        ))
    );
    Ok(WIDER * beam)
}

/// Write the scene as the images of each layout can show it. They are not divided by the pattern of the elements, so the truth is multiplied by it, as it
/// is at the centre of the band. The pedestal, a constant that is taken from a warm scene before it is observed and added to the images, is not dimmed.
///
/// # Errors
/// A wrong element, or an error of the file system.
pub(super) fn write_truths(args: &CompareArgs, designs: &[Design], folder: &Path) -> Result<()> {
    let o = &args.observed;
    if o.element == Element::None {
        return Ok(());
    }
    let how = SimulateOptions {
        element: o.element,
        element_diameter: o.element_diameter,
        element_width: o.element_width,
        ..SimulateOptions::default()
    };
    for d in designs {
        let pattern: ElementPattern = how.pattern(&d.layout).context(&d.given)?;
        let mut image = open_image(&folder.join(TRUTH))?;
        let grid = image.grid.clone();
        let pedestal = open_image(&folder.join(&d.name).join(IMAGES[0].file))?.pedestal_k.unwrap_or(0.0);
        for ((_, _, row, column), v) in image.data.indexed_iter_mut() {
            let power = pattern.power(grid.l_at(column as f64), grid.m_at(row as f64), args.freq.si());
            *v = pedestal + power * (*v - pedestal);
        }
        image.pattern = pattern;
        let file = scene_file(&d.name, args);
        write_image(&folder.join(&file), &image, ImageOptions::default()).context(file)?;
    }
    Ok(())
}

/// The rule by which images are compared, in words.
pub(super) fn rule(args: &CompareArgs, resolution_rad: f64) -> String {
    let truth = if args.observed.element == Element::None {
        "the scene"
    } else {
        "the scene times the pattern of the elements (without the pedestal)"
    };
    format!(
        "Every image is compared with {truth}, both at the resolution of a round beam of {}, 1.1 times the coarsest beam of all images: no layout gains or loses by \
         its resolution.",
        angle(resolution_rad)
    )
}
