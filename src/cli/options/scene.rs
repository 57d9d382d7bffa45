//! `--scene`: a FITS image, a PNG, a source list or a scene description, distinguished by their contents.

use crate::cli::context::Context;
use crate::cli::failure::{Context as _, Failure, Result, ensure};
use crate::cli::forecast::rendered;
use crate::cost::Traced;
use crate::simulate::{SceneOptions, SkyModel};
use cittert_arrays::{BrightnessUnit, Image, PhaseCenter, Polarization, SkyFrame, SkyGrid, SpectralWindow, VisUnit};
use cittert_phenomenology::{RenderOptions, Scene, View};
use clap::Args;
use ndarray::Array4;
use std::cell::RefCell;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The scene, and the size of its pixels if the file does not give it.
#[derive(Debug, Clone, Args)]
pub struct SceneArgs {
    /// FITS image (K, Jy/pixel or Jy/beam), grey-scale PNG, source list (CSV) or scene description (TOML).
    #[arg(long, value_name = "FILE")]
    pub scene: PathBuf,
    #[command(flatten)]
    pub how: SceneOptions,
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
    ensure!(!path.is_dir(), Failure::message(format!("{}: it is a directory, expected a scene (FITS, PNG, CSV or TOML)", path.display())));
    cittert_formats::refuse_special(path)?;
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
    /// The file is not a scene, or an option that this kind of scene needs is missing.
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
        let scene = read_scene(&self.scene)?;
        let grid = self.grid(&scene, center)?;
        let image = if self.how.scene_channels { scene.render_channels(&grid, spectrum) } else { scene.render(&grid, spectrum) };
        image.context(self.scene.display())
    }

    /// The grid on which a scene description is rendered.
    fn grid(&self, scene: &Scene, center: &PhaseCenter) -> Result<SkyGrid> {
        let path = &self.scene;
        let natural = scene.natural_grid(self.how.scene_size).context(path.display())?;
        match (self.how.scene_size, self.how.scene_cell, natural) {
            (Some(size), Some(cell), _) => Ok(SkyGrid::new(size, size, cell.si(), SkyGrid::frame_of(center))?),
            (_, None, Some(grid)) => Ok(grid),
            _ => Err(Failure::usage(format!(
                "{}: a scene description needs --scene-size and --scene-cell (a scene with a camera of its own neither, or the size alone)",
                path.display()
            ))),
        }
    }

    /// The scene as a forecast needs it, and what reading or rendering it takes. A scene of solids is rendered with few pixels, which then stand for all of its image.
    ///
    /// # Errors
    /// As [`SceneArgs::load`].
    pub fn foreseen(&self, center: &PhaseCenter, spectrum: &SpectralWindow, context: &Context) -> Result<(LoadedScene, Traced)> {
        let started = Instant::now();
        let scene = if matches!(kind(&self.scene)?, Kind::Toml) { Some(read_scene(&self.scene)?) } else { None };
        let Some(scene @ Scene::Solids(solids)) = &scene else {
            let loaded = self.load(center, spectrum, context)?;
            let values: usize = loaded.sky.images.iter().map(|i| i.data.len()).sum();
            let trace_s = started.elapsed().as_secs_f64();
            return Ok((loaded, Traced { trace_s, bytes: (2 * values * size_of::<f64>()) as f64, ..Traced::default() }));
        };
        let grid = self.grid(scene, center)?;
        let options = RenderOptions { per_channel: self.how.scene_channels, ..RenderOptions::default() };
        let seen = || -> Result<_> {
            let view = View::on_grid(solids.camera()?, &grid)?;
            rendered(solids, &view, spectrum, &options, None)
        };
        let seen = seen().context(self.scene.display())?;
        let work = Traced { setup_s: seen.setup_s, trace_s: seen.trace_s, bytes: seen.bytes, written: 0.0 };
        let (data, small) = (seen.spread((grid.n_l, grid.n_m)), seen.image);
        let (Some(data), Some(small)) = (data, small) else { return Err(Failure::message("a picture without an image")) };
        let image = Image::new(grid, small.spectrum, small.polarizations, data, BrightnessUnit::Kelvin)?;
        let name = solids.name().to_owned();
        Ok((LoadedScene { sky: SkyModel::of_image(image), unit: VisUnit::KelvinSr, name }, work))
    }

    fn png(&self, center: &PhaseCenter, spectrum: &SpectralWindow) -> Result<Image> {
        let path = &self.scene;
        let (Some(cell), Some(min), Some(max)) = (self.how.scene_cell, self.how.scene_min, self.how.scene_max) else {
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

/// The text of a scene description.
///
/// # Errors
/// A file that cannot be read.
pub fn scene_text(path: &Path) -> Result<String> {
    Ok(cittert_formats::read_text(path)?)
}

/// Reads grey pictures that a scene description names, beside it.
pub fn pictures_beside(path: &Path) -> impl Fn(&str) -> Result<ndarray::Array2<f64>, Box<dyn std::error::Error + Send + Sync>> {
    let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
    move |name| Ok(cittert_formats::read_grey_png(&folder.join(name))?)
}

/// A scene description with the pictures it names.
///
/// # Errors
/// A file that cannot be read or is no scene.
pub fn read_scene(path: &Path) -> Result<Scene> {
    Ok(read_scene_and_pictures(path)?.0)
}

/// A scene description, and the files of the pictures that it names.
///
/// # Errors
/// A file that cannot be read or is no scene.
pub fn read_scene_and_pictures(path: &Path) -> Result<(Scene, Vec<PathBuf>)> {
    let read = pictures_beside(path);
    let folder = path.parent().unwrap_or(Path::new(""));
    let named = RefCell::new(Vec::new());
    let noting = |name: &str| {
        named.borrow_mut().push(folder.join(name));
        read(name)
    };
    let scene = Scene::from_toml_with(&scene_text(path)?, &noting).context(path.display())?;
    Ok((scene, named.into_inner()))
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
