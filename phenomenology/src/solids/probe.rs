//! Hits of rays and regions of points, in a scene or in a text of bodies and regions.

use super::file::SceneFile;
use super::images::ReadGrey;
use super::place::place;
use super::scene::SolidScene;
use crate::error::Result;
use crate::geometry::probe::{PointAnswer, PointRow, RayAnswer, RayRow};
use crate::geometry::{Geometry, looks_like_bodies, read_text};

/// Bodies and regions of the TOML of a scene or of a text. Surfaces are not read.
///
/// # Errors
/// The line and the fault.
pub fn read_geometry(text: &str) -> Result<Geometry> {
    if looks_like_bodies(text) {
        let model = read_text(text, 1)?;
        return Ok(Geometry::new(model.bodies, model.regions)?);
    }
    let file: SceneFile = toml::from_str(text)?;
    let placed = place(&file, text)?;
    Ok(Geometry::new(placed.bodies, placed.regions)?)
}

/// A scene with its ground, or bodies and regions alone.
#[derive(Debug, Clone)]
pub enum Probed {
    /// A scene of solids.
    Scene(Box<SolidScene>),
    /// Bodies and regions alone.
    Bare(Box<Geometry>),
}

/// A scene of solids from its TOML, or bodies and regions from their text. `read` reads the pictures that a scene names.
///
/// # Errors
/// The line and the fault, and a picture that cannot be read.
pub fn read_probe_with(text: &str, read: ReadGrey<'_>) -> Result<Probed> {
    if looks_like_bodies(text) {
        read_geometry(text).map(|g| Probed::Bare(Box::new(g)))
    } else {
        SolidScene::from_toml_with(text, read).map(|s| Probed::Scene(Box::new(s)))
    }
}

impl Probed {
    /// The first hits of rays on one region, or on any region and the ground.
    ///
    /// # Errors
    /// An unknown region; a ray with a number that is not finite or without a direction.
    pub fn rays(&self, region: Option<&str>, rays: &[RayRow]) -> Result<Vec<RayAnswer>> {
        match self {
            Self::Bare(g) => Ok(g.probe_rays(region, rays)?),
            Self::Scene(s) => s.probe_rays(region, rays),
        }
    }

    /// The regions of points.
    ///
    /// # Errors
    /// An unknown region or a point that is not finite.
    pub fn points(&self, region: Option<&str>, points: &[PointRow]) -> Result<Vec<PointAnswer>> {
        let geometry = match self {
            Self::Bare(g) => g.as_ref(),
            Self::Scene(s) => &s.geometry,
        };
        Ok(geometry.probe_points(region, points)?)
    }
}

impl SolidScene {
    /// The first hits of rays on one region, or on any region and the ground.
    ///
    /// # Errors
    /// An unknown region; a ray with a number that is not finite or without a direction.
    pub fn probe_rays(&self, region: Option<&str>, rays: &[RayRow]) -> Result<Vec<RayAnswer>> {
        let mut answers = self.geometry.probe_rays(region, rays)?;
        if let (None, Some(ground)) = (region, &self.terrain) {
            for (i, (answer, row)) in answers.iter_mut().zip(rays).enumerate() {
                let ray = row.ray(i + 1)?;
                if let Some(hit) = ground.hit(&ray, self.geometry.eps(), answer.t.unwrap_or(f64::INFINITY)) {
                    *answer = RayAnswer::of(hit.t, hit.normal, "ground");
                }
            }
        }
        Ok(answers)
    }
}
