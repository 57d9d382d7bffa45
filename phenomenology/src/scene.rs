//! A scene of any kind.

use crate::analytic::AnalyticScene;
use crate::camera::View;
use crate::error::{Result, SceneError};
use crate::solids::{ReadGrey, SolidScene};
use crate::trace::RenderOptions;
use cittert_arrays::{Image, SkyGrid, SpectralWindow};

/// A scene of any kind.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Scene {
    /// Shapes of given temperatures on the plane of direction cosines.
    Analytic(AnalyticScene),
    /// Solids and a ground, with an atmosphere and a camera.
    Solids(Box<SolidScene>),
}

/// The key that gives the kind of a scene.
#[derive(serde::Deserialize)]
struct Kind {
    kind: Option<String>,
}

impl Scene {
    /// Read a scene from the text of its TOML.
    ///
    /// # Errors
    /// TOML that does not parse (with the line), an unknown kind or key, a value outside its range.
    pub fn from_toml(text: &str) -> Result<Self> {
        Self::read(text, SolidScene::from_toml)
    }

    /// As [`Scene::from_toml`]. `read` reads the pictures that the scene names.
    ///
    /// # Errors
    /// As [`Scene::from_toml`], and a picture that cannot be read.
    pub fn from_toml_with(text: &str, read: ReadGrey<'_>) -> Result<Self> {
        Self::read(text, |text| SolidScene::from_toml_with(text, read))
    }

    fn read(text: &str, solids: impl Fn(&str) -> Result<SolidScene>) -> Result<Self> {
        let kind: Kind = toml::from_str(text)?;
        match kind.kind.as_deref() {
            Some("analytic") => AnalyticScene::from_toml(text).map(Self::Analytic),
            Some("solids") => solids(text).map(|s| Self::Solids(Box::new(s))),
            other => Err(SceneError::bad_value(
                "key `kind` of the scene",
                other.map_or_else(|| "missing".into(), |k| format!("{k:?}")),
                "\"analytic\" or \"solids\"",
            )),
        }
    }

    /// Name of the scene.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Analytic(s) => &s.name,
            Self::Solids(s) => s.name(),
        }
    }

    /// Frequency for which the scene is described, Hz, if its file states one.
    #[must_use]
    pub fn freq_hz(&self) -> Option<f64> {
        match self {
            Self::Analytic(_) => None,
            Self::Solids(s) => s.file.freq_hz,
        }
    }

    /// The grid of direction cosines of the scene's own camera, with the pixels of the camera or with `side_px` pixels on each side.
    /// `None` if the scene has no camera.
    ///
    /// # Errors
    /// A field of view or a number of pixels outside its range.
    pub fn natural_grid(&self, side_px: Option<usize>) -> Result<Option<SkyGrid>> {
        let Self::Solids(s) = self else { return Ok(None) };
        let Some(camera) = &s.file.camera else { return Ok(None) };
        let camera = camera.get_ref().in_direction_cosines();
        side_px.map_or(camera.clone(), |n| camera.with_side(n)).grid().map(Some)
    }

    /// Brightness temperature in K, computed separately for every channel of a spectrum \[chan, pol = I, m, l\].
    ///
    /// # Errors
    /// As [`Scene::render`], and a scene of shapes, whose temperatures do not depend on frequency.
    pub fn render_channels(&self, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Image> {
        match self {
            Self::Analytic(s) => Err(SceneError::bad_value(
                format_args!("scene `{}`", s.name),
                "of shapes with fixed temperatures",
                "a scene of solids, where every channel is to have its own temperatures",
            )),
            Self::Solids(s) => {
                let options = RenderOptions { per_channel: true, ..RenderOptions::default() };
                Ok(s.picture(&View::on_grid(s.camera()?, grid)?, spectrum, &options)?.temperature)
            }
        }
    }

    /// Brightness temperature in K \[chan = 1, pol = I, m, l\].
    ///
    /// # Errors
    /// A grid or value out of range.
    pub fn render(&self, grid: &SkyGrid, spectrum: &SpectralWindow) -> Result<Image> {
        match self {
            Self::Analytic(s) => s.render(grid, spectrum),
            Self::Solids(s) => s.render(grid, spectrum),
        }
    }
}
