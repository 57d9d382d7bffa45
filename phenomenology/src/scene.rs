//! The public face: any scene that can be rendered.

use crate::analytic::AnalyticScene;
use crate::solids::SolidScene;
use crate::{Result, SceneError};
use cittert_arrays::{Image, SkyGrid, SpectralWindow};

/// A scene of any kind.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Scene {
    /// Shapes of given temperature on the plane of direction cosines.
    Analytic(AnalyticScene),
    /// Solids on a ground, under an atmosphere, before a camera.
    Solids(Box<SolidScene>),
}

/// The one key that tells the kinds apart.
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
        let kind: Kind = toml::from_str(text)?;
        match kind.kind.as_deref() {
            Some("analytic") => AnalyticScene::from_toml(text).map(Self::Analytic),
            Some("solids") => SolidScene::from_toml(text).map(|s| Self::Solids(Box::new(s))),
            other => Err(SceneError::BadValue {
                what: "key `kind` of the scene".into(),
                value: other.map_or_else(|| "missing".into(), |k| format!("{k:?}")),
                expected: "\"analytic\" or \"solids\"",
            }),
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

    /// The grid of the scene's own camera; `None` where the scene has none.
    #[must_use]
    pub fn natural_grid(&self) -> Option<SkyGrid> {
        match self {
            Self::Analytic(_) => None,
            Self::Solids(s) => s.camera().and_then(crate::camera::Camera::grid).ok(),
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
