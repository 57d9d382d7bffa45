//! A checked scene of solids.

use super::covers::Covers;
use super::file::SceneFile;
use super::weather::Weather;
use crate::atmosphere::{Atmosphere, Geometry as SkyGeometry};
use crate::camera::Camera;
use crate::error::{Result, SceneError};
use crate::geometry::Geometry;
use crate::surfaces::{Canopy, Roughness, StackDescription};
use crate::terrain::Terrain;

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
    /// Vegetation on it.
    pub canopy: Option<Canopy>,
}

/// The air of a scene.
#[derive(Debug, Clone)]
pub struct Air {
    /// Profile, layers and models; `None` for a scene in vacuum.
    pub atmosphere: Option<Atmosphere>,
    /// Shape of the path of rays to the sky.
    pub geometry: SkyGeometry,
    /// Height of the origin of the scene above the lowest level of the profile, km.
    pub altitude_km: f64,
    /// Temperature behind the air, K.
    pub background_k: f64,
}

/// A scene of solids on a ground.
#[derive(Debug, Clone)]
pub struct SolidScene {
    pub(crate) file: SceneFile,
    pub(crate) geometry: Geometry,
    pub(crate) covers: Covers,
    pub(crate) surfaces: Vec<SurfaceSource>,
    pub(crate) terrain: Option<Terrain>,
    pub(crate) air: Air,
    /// Clouds, fog banks, rain shafts and haze layers.
    pub(crate) weather: Option<Weather>,
    /// Line of the camera, 0 if there is none.
    pub(super) camera_line: usize,
}

impl SolidScene {
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
        self.file.camera.as_ref().map(toml::Spanned::get_ref).ok_or_else(|| {
            SceneError::bad_value(
                "[camera] of the scene",
                "missing",
                "a camera with position_m, and look_at_m or heading_deg and pitch_deg",
            )
        })
    }
}
