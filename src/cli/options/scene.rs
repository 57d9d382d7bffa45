//! `--scene`: a FITS image, a PNG, a source list or a scene description, told apart by what they hold.

use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result};
use crate::simulate::SkyModel;
use cittert_arrays::quantity::{Angle, Temperature};
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit};
use cittert_phenomenology::Scene;
use clap::Args;
use ndarray::Array4;
use std::io::Read;
use std::path::{Path, PathBuf};

/// What is looked at, and how large its pixels are where it has none of its own.
#[derive(Debug, Clone, Args)]
pub struct SceneArgs {
    /// FITS image (K, Jy/pixel or Jy/beam), grey-scale PNG, source list (CSV) or scene description (TOML).
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    /// Size of a pixel of a PNG or a scene description.
    #[arg(long, value_name = "ANGLE")]
    pub scene_cell: Option<Angle>,
    /// Pixels along each side of a scene description.
    #[arg(long, value_name = "N")]
    pub scene_size: Option<usize>,
    /// Temperature of black in a PNG.
    #[arg(long, value_name = "TEMP")]
    pub scene_min: Option<Temperature>,
    /// Temperature of white in a PNG.
    #[arg(long, value_name = "TEMP")]
    pub scene_max: Option<Temperature>,
}

/// A scene ready to be observed.
#[derive(Debug)]
pub struct LoadedScene {
    /// Image or sources.
    pub sky: SkyModel,
    /// Unit that visibilities of it have.
    pub unit: VisUnit,
    /// Name of the scene.
    pub name: String,
}

enum Kind {
    Fits,
    Png,
    Csv,
    Toml,
}

fn kind(path: &Path) -> Result<Kind> {
    let failed = |e: std::io::Error| Failure::message(format!("{}: cannot read the scene: {e}", path.display()));
    if path.is_dir() {
        return Err(Failure::message(format!("{}: it is a directory, expected a scene (FITS, PNG, CSV or TOML)", path.display())));
    }
    let mut head = Vec::new();
    std::fs::File::open(path).map_err(failed)?.take(16).read_to_end(&mut head).map_err(failed)?;
    Ok(match head.as_slice() {
        [] => return Err(Failure::message(format!("{}: the file is empty, expected a scene (FITS, PNG, CSV or TOML)", path.display()))),
        h if h.starts_with(b"SIMPLE") || h.starts_with(&[0x1f, 0x8b]) => Kind::Fits,
        [0x89, b'P', b'N', b'G', ..] => Kind::Png,
        _ if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml")) => Kind::Toml,
        _ => Kind::Csv,
    })
}

impl SceneArgs {
    /// Read the scene as seen around a phase centre.
    ///
    /// # Errors
    /// A file that is no scene, or options that its kind needs and that are missing.
    pub fn load(&self, center: &PhaseCenter, spectrum: &SpectralWindow, context: &Context) -> Result<LoadedScene> {
        let path = &self.scene;
        let image = match kind(path)? {
            Kind::Csv => {
                let sources = cittert_formats::read_sources(path)?;
                return Ok(LoadedScene { sky: SkyModel::of_sources(sources), unit: VisUnit::Jy, name: stem(path) });
            }
            Kind::Fits => as_seen(cittert_formats::open_image(path)?, center, context),
            Kind::Png => self.png(center, spectrum)?,
            Kind::Toml => self.render(center, spectrum)?,
        };
        let unit = if image.unit == BrightnessUnit::Kelvin { VisUnit::KelvinSr } else { VisUnit::Jy };
        let name = if image.object.is_empty() { stem(path) } else { image.object.clone() };
        Ok(LoadedScene { sky: SkyModel::of_image(image), unit, name })
    }

    /// Render a scene description around a phase centre.
    ///
    /// # Errors
    /// A file that is no scene, or a missing size.
    pub fn render(&self, center: &PhaseCenter, spectrum: &SpectralWindow) -> Result<Image> {
        let path = &self.scene;
        let text =
            std::fs::read_to_string(path).map_err(|e| Failure::message(format!("{}: cannot read the scene: {e}", path.display())))?;
        let scene = Scene::from_toml(&text).context(format!("{}", path.display()))?;
        let grid = match (self.scene_size, self.scene_cell, scene.natural_grid()) {
            (Some(size), Some(cell), _) => SkyGrid::new(size, size, cell.si(), SkyGrid::frame_of(center))?,
            (None, None, Some(grid)) => grid,
            _ => {
                return Err(Failure::usage(format!(
                    "{}: a scene description needs --scene-size and --scene-cell (both or, for a scene with a camera of its own, neither)",
                    path.display()
                )));
            }
        };
        Ok(scene.render(&grid, spectrum)?)
    }

    fn png(&self, center: &PhaseCenter, spectrum: &SpectralWindow) -> Result<Image> {
        let path = &self.scene;
        let (Some(cell), Some(min), Some(max)) = (self.scene_cell, self.scene_min, self.scene_max) else {
            return Err(Failure::usage(format!("{}: a PNG scene needs --scene-cell, --scene-min and --scene-max", path.display())));
        };
        let grey = cittert_formats::read_grey_png(path)?; // [row from the bottom, column], 0 black to 1 white
        let (rows, columns) = grey.dim();
        let grid = SkyGrid::new(columns, rows, cell.si(), SkyGrid::frame_of(center))?;
        let data = Array4::from_shape_fn((1, 1, rows, columns), |(_, _, m, l)| min.si() + (max.si() - min.si()) * grey[[m, l]]);
        let band = SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])?;
        let mut image = Image::new(grid, band, vec![Polarization::I], data, BrightnessUnit::Kelvin)?;
        image.object = stem(path);
        Ok(image)
    }
}

/// A picture of the sky in front of a boresight is taken as it appears: its columns run to the right.
fn as_seen(mut image: Image, center: &PhaseCenter, context: &Context) -> Image {
    if center.ra_dec_rad().is_none() && image.grid.frame != SkyFrame::Boresight {
        context.console.note("the scene has celestial coordinates but the array looks along its boresight: the picture is taken as it appears, l to the right");
        image.grid.frame = SkyFrame::Boresight;
    }
    image
}

fn stem(path: &Path) -> String {
    path.file_stem().map(|s| s.to_string_lossy().into_owned()).unwrap_or_default()
}
