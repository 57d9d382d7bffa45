//! Writing a scene: as TOML, or its solids as text.

use super::file::{BodyRow, RegionRow, SceneFile};
use super::scene::SolidScene;
use crate::error::Result;
use crate::geometry::{TextModel, write_text};
use toml::Spanned;

fn bare<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

impl SolidScene {
    /// The file as TOML; reading it back gives the same scene.
    ///
    /// # Errors
    /// A value that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(&self.file)?)
    }

    /// All bodies and regions, placed, as MORSE/GIFT-style text.
    #[must_use]
    pub fn to_text(&self) -> String {
        let regions: Vec<_> = self.geometry.regions().iter().map(|r| r.source.clone()).collect();
        let surfaces: Vec<Option<String>> = (0..regions.len())
            .map(|i| self.covers.of_region(i).map(|c| self.covers.name(c).to_owned()).or_else(|| Some("air".into())))
            .collect();
        write_text(self.geometry.bodies(), &regions, &surfaces)
    }
}

impl SceneFile {
    /// A scene file that holds the bodies and regions of a text as rows; surfaces and camera are left to be added.
    #[must_use]
    pub fn of_text(name: &str, model: &TextModel) -> Self {
        let body = |b: &crate::geometry::NamedBody| BodyRow {
            name: b.name.clone(),
            code: b.body.entry.code.to_owned(),
            data: b.body.parameters.clone(),
            surface: None,
            temperature_k: None,
        };
        let region = |(r, surface): (&crate::geometry::RegionSource, &Option<String>)| RegionRow {
            name: r.name.clone(),
            is: r.expression.to_string(),
            surface: surface.clone(),
            temperature_k: None,
            face: Vec::new(),
        };
        Self {
            kind: "solids".into(),
            name: name.to_owned(),
            description: String::new(),
            extrapolate: false,
            camera: None,
            atmosphere: None,
            ground: None,
            surface: Default::default(),
            bodies_and_regions: None,
            body: model.bodies.iter().map(|b| bare(body(b))).collect(),
            region: model.regions.iter().zip(&model.surfaces).map(|r| bare(region(r))).collect(),
            assembly: Default::default(),
            instance: Vec::new(),
        }
    }

    /// The file as TOML.
    ///
    /// # Errors
    /// A value that TOML cannot hold.
    pub fn to_toml(&self) -> Result<String> {
        Ok(toml::to_string(self)?)
    }
}
