//! The options of `layout compare`.

use crate::cli::failure::{Failure, Result, ensure};
use crate::deconvolve::{Algorithm, CleanOptions};
use crate::imaging::{ImageSize, ImagingOptions};
use crate::simulate::{Element, SceneOptions, SimulateOptions};
use cittert_arrays::quantity::{Angle, Frequency, Length};
use cittert_arrays::{BuiltinLayout, FigureOptions, Weighting};
use clap::Args;
use std::path::{Path, PathBuf};

/// Options of `layout compare`.
#[derive(Debug, Args)]
pub struct CompareArgs {
    /// Names of built-in layouts, or layout files; two or more.
    #[arg(value_name = "LAYOUT", required = true)]
    pub(super) layouts: Vec<String>,
    /// Frequency, the centre of the band.
    #[arg(long, value_name = "FREQ")]
    pub(super) freq: Frequency,
    /// Folder of the results: comparison.json, report.html, and a folder for each layout.
    #[arg(short, long, value_name = "DIR")]
    pub(super) output: PathBuf,
    /// Replace a folder of an earlier comparison.
    #[arg(long)]
    pub(super) overwrite: bool,
    #[command(flatten)]
    pub(super) figures: FigureOptions,
    #[command(flatten)]
    pub(super) observed: ObservedArgs,
}

/// The scene that all layouts observe, and how they observe and image it.
#[derive(Debug, Args)]
#[command(next_help_heading = "The same scene for all layouts")]
pub(super) struct ObservedArgs {
    /// Also image this scene with every layout: FITS image, grey-scale PNG, source list (CSV) or scene description (TOML).
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(super) how: SceneOptions,
    /// Add thermal noise for the observing time, by the SEFD or system temperature that is given or in the layout.
    #[arg(long)]
    pub(super) noise: bool,
    /// Seed of the noise, the same for all layouts.
    #[arg(long, value_name = "N", default_value_t = SimulateOptions::default().seed)]
    pub(super) seed: u64,
    /// Power pattern of each element: none, airy (of its diameter), gaussian (of the given width) or cos^N.
    #[arg(long, value_name = "KIND", default_value_t = Element::None)]
    pub(super) element: Element,
    /// Diameter of an airy element.
    #[arg(long, value_name = "LENGTH")]
    pub(super) element_diameter: Option<Length>,
    /// Full width at half maximum of a gaussian element.
    #[arg(long, value_name = "ANGLE")]
    pub(super) element_width: Option<Angle>,
    /// Number of pixels along each side of all images, or COLUMNSxROWS [default: as many as cover the scene].
    #[arg(long, value_name = "N")]
    pub(super) size: Option<ImageSize>,
    /// Size of a pixel of all images [default: a quarter of a fringe of the longest baseline of all layouts].
    #[arg(long, value_name = "ANGLE")]
    pub(super) cell: Option<Angle>,
    /// Scheme of the weights of all images: natural, uniform or briggs.
    #[arg(long, value_name = "SCHEME", value_enum, hide_possible_values = true, default_value_t = ImagingOptions::default().weighting)]
    pub(super) image_weighting: Weighting,
    /// Algorithm of CLEAN: hogbom, clark, or multiscale for extended scenes.
    #[arg(long, value_name = "NAME", default_value_t = CleanOptions::default().algorithm)]
    pub(super) algorithm: Algorithm,
    /// Compare the images with the scene only inside a disc around the centre. Its radius is this fraction of the smaller side.
    #[arg(long, value_name = "FRACTION")]
    pub(super) disc: Option<f64>,
}

impl CompareArgs {
    /// Refuse options that would have no effect, and numbers of layouts that cannot be compared.
    pub(super) fn check(&self) -> Result<()> {
        let n = self.layouts.len();
        ensure!(n >= 2, Failure::usage(format!("{n} layout is nothing to compare: give two layouts or more")));
        for (k, name) in self.layouts.iter().enumerate() {
            if let Some(twin) = self.layouts[..k].iter().find(|other| is_one(other, name)) {
                let both = if twin == name { format!("{name} is given twice") } else { format!("{twin} and {name} are one file") };
                return Err(Failure::usage(format!("{both}: give each layout once")));
            }
        }
        self.figures.check(self.freq.si()).map_err(|e| Failure::call(e.into()))?;
        let o = &self.observed;
        if o.scene.is_some() {
            let wide = !o.noise || self.figures.bandwidth.is_some();
            ensure!(wide, Failure::usage("--noise needs --bandwidth: the noise of a visibility follows from the width of its channel"));
            return Ok(());
        }
        let given = [
            ("noise", o.noise),
            ("seed", o.seed != SimulateOptions::default().seed),
            ("element", o.element != Element::None),
            ("element-diameter", o.element_diameter.is_some()),
            ("element-width", o.element_width.is_some()),
            ("size", o.size.is_some()),
            ("cell", o.cell.is_some()),
            ("image-weighting", o.image_weighting != ImagingOptions::default().weighting),
            ("disc", o.disc.is_some()),
            ("algorithm", o.algorithm != CleanOptions::default().algorithm),
            ("scene-cell", o.how.scene_cell.is_some()),
            ("scene-size", o.how.scene_size.is_some()),
            ("scene-channels", o.how.scene_channels),
            ("scene-min", o.how.scene_min.is_some()),
            ("scene-max", o.how.scene_max.is_some()),
        ];
        match given.iter().find(|g| g.1) {
            Some((option, _)) => Err(Failure::usage(format!("--{option} needs --scene: without a scene no image is made"))),
            None => Ok(()),
        }
    }
}

/// Whether two texts name the same layout.
fn is_one(a: &str, b: &str) -> bool {
    let file = |text: &str| if BuiltinLayout::find(text).is_some() { None } else { Path::new(text).canonicalize().ok() };
    a == b || file(a).zip(file(b)).is_some_and(|(a, b)| a == b)
}
