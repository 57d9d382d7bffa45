//! The scene made of a file: everything placed, looked up and checked.

use super::build;
use super::covers::Covers;
use super::file::SceneFile;
use super::images::ReadGrey;
use crate::atmosphere::{Atmosphere, Geometry as SkyGeometry};
use crate::camera::{Camera, View};
use crate::error::{Result, SceneError};
use crate::geometry::Geometry;
use crate::surfaces::{Canopy, Roughness, StackDescription};
use crate::terrain::Terrain;
use crate::trace::{Picture, ProgressFn, RenderOptions, Tracer};
use cittert_arrays::{Image, SkyGrid, SpectralWindow};

/// A surface before a frequency is chosen.
#[derive(Debug, Clone)]
pub struct SurfaceSource {
    /// Name.
    pub name: String,
    /// Line of the file, 0 if there is none.
    pub line: usize,
    /// Layers.
    pub stack: StackDescription,
    /// Roughness.
    pub roughness: Roughness,
    /// Azimuth of the first slope axis from north over east, rad.
    pub slope_azimuth_rad: f64,
    /// What grows on it.
    pub canopy: Option<Canopy>,
}

/// The air of a scene.
#[derive(Debug, Clone)]
pub struct Air {
    /// Profile, layers and models; `None` for a scene in vacuum.
    pub atmosphere: Option<Atmosphere>,
    /// How rays to the sky run.
    pub geometry: SkyGeometry,
    /// Height of the scene's zero, km.
    pub altitude_km: f64,
    /// Temperature behind the air, K.
    pub background_k: f64,
}

/// A scene of solids on a ground.
#[derive(Debug, Clone)]
pub struct SolidScene {
    pub(super) file: SceneFile,
    pub(crate) geometry: Geometry,
    pub(crate) covers: Covers,
    pub(crate) surfaces: Vec<SurfaceSource>,
    pub(crate) terrain: Option<Terrain>,
    pub(crate) air: Air,
    /// Line of the camera, 0 if there is none.
    pub(super) camera_line: usize,
}

impl SolidScene {
    /// Read from TOML.
    ///
    /// # Errors
    /// The line and the fault: TOML that does not parse, unknown keys, bodies that cannot be, unknown bodies, surfaces or
    /// assemblies, regions without material, an empty scene, a camera inside a solid or under the ground.
    pub fn from_toml(text: &str) -> Result<Self> {
        let file: SceneFile = toml::from_str(text)?;
        build::build(file, text)
    }

    /// As [`SolidScene::from_toml`], with the pictures that the scene names.
    ///
    /// # Errors
    /// As [`SolidScene::from_toml`], and a picture that cannot be read.
    pub fn from_toml_with(text: &str, read: ReadGrey<'_>) -> Result<Self> {
        let mut file: SceneFile = toml::from_str(text)?;
        let lines = super::place::Lines::new(text);
        super::images::resolve(&mut file, read, &|offset| lines.of(offset))?;
        build::build(file, text)
    }

    /// Name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.file.name
    }

    /// The file as written.
    #[must_use]
    pub fn file(&self) -> &SceneFile {
        &self.file
    }

    /// Bodies and regions, placed.
    #[must_use]
    pub fn geometry(&self) -> &Geometry {
        &self.geometry
    }

    /// The camera of the file.
    ///
    /// # Errors
    /// A scene without `[camera]`.
    pub fn camera(&self) -> Result<&Camera> {
        self.file.camera.as_ref().map(toml::Spanned::get_ref).ok_or_else(|| SceneError::BadValue {
            what: "[camera] of the scene".into(),
            value: "missing".into(),
            expected: "a camera with position_m, and look_at_m or heading_deg and pitch_deg",
        })
    }

    /// The same scene before another camera.
    ///
    /// # Errors
    /// A camera inside a solid, under the ground, or that cannot be.
    pub fn with_camera(mut self, camera: Camera) -> Result<Self> {
        self.file.camera = Some(toml::Spanned::new(0..0, camera));
        self.camera_line = 0;
        self.check_camera()?;
        Ok(self)
    }

    /// Brightness temperature in K on a grid of direction cosines around the axis of the camera, \[chan = 1, pol = I, m, l\]: no
    /// resampling lies between the scene and the visibilities.
    ///
    /// # Errors
    /// No camera, or a surface or sky that cannot be had at this frequency.
    pub fn render(&self, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Image> {
        let view = View::on_grid(self.camera()?, grid)?;
        Ok(self.picture(&view, spectrum, &RenderOptions::default())?.temperature)
    }

    /// A picture of a view with its maps.
    ///
    /// # Errors
    /// As [`SolidScene::render`], and options out of range.
    pub fn picture(&self, view: &View, spectrum: &SpectralWindow, options: &RenderOptions) -> Result<Picture> {
        self.picture_observed(view, spectrum, options, None)
    }

    /// As [`SolidScene::picture`], telling how many rows are done.
    ///
    /// # Errors
    /// As [`SolidScene::picture`].
    pub fn picture_observed(
        &self,
        view: &View,
        spectrum: &SpectralWindow,
        options: &RenderOptions,
        progress: Option<ProgressFn<'_>>,
    ) -> Result<Picture> {
        self.check_position(view.position)?;
        let freqs: Vec<f64> = if options.per_channel { spectrum.freq_hz().to_vec() } else { vec![spectrum.mean_hz()] };
        let options = RenderOptions { highest_m: options.highest_m.max(view.position.z), ..options.clone() };
        let tracer = Tracer::new(self, &freqs, &options)?;
        let band =
            if options.per_channel { spectrum.clone() } else { SpectralWindow::new(vec![spectrum.mean_hz()], vec![spectrum.extent_hz()])? };
        let mut picture = tracer.picture(view, &band, progress)?;
        picture.temperature.object.clone_from(&self.file.name);
        Ok(picture)
    }
}
