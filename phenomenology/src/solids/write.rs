//! Writing a scene: as TOML, or its solids as text.

use super::file::{BodyRow, RegionRow, SceneFile, SurfaceRow};
use super::scene::SolidScene;
use crate::dielectrics::Material;
use crate::error::Result;
use crate::geometry::{TextModel, is_void, write_text};
use crate::surfaces::RawLayer;
use std::collections::BTreeSet;
use toml::Spanned;

fn bare<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

/// Name of the surface of regions that have none.
const BLACK: &str = "black";

/// The surface of a name in a text: the material of this name, or black.
fn surface_of(name: &str) -> SurfaceRow {
    let layer = match Material::by_name(name) {
        Ok(_) => RawLayer { material: Some(name.to_owned()), ..RawLayer::default() },
        Err(_) => RawLayer { eps: Some([1.0, 0.0]), ..RawLayer::default() },
    };
    SurfaceRow { coherent: true, layer: vec![bare(layer)], roughness: None, slope_azimuth_deg: 0.0, canopy: None }
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
    /// A scene file that holds the bodies and regions of a text as rows. A surface with the name of a material consists of this material.
    /// Other surfaces, and regions without a surface, are black. The caller must add the camera.
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
            surface: Some(surface.clone().unwrap_or_else(|| BLACK.into())),
            temperature_k: None,
            face: Vec::new(),
        };
        let rows: Vec<RegionRow> = model.regions.iter().zip(&model.surfaces).map(region).collect();
        let names: BTreeSet<&str> = rows.iter().filter_map(|r| r.surface.as_deref()).filter(|s| !is_void(s)).collect();
        Self {
            kind: "solids".into(),
            name: name.to_owned(),
            description: String::new(),
            freq_hz: None,
            extrapolate: false,
            camera: None,
            atmosphere: None,
            ground: None,
            surface: names.into_iter().map(|n| (n.to_owned(), bare(surface_of(n)))).collect(),
            bodies_and_regions: None,
            body: model.bodies.iter().map(|b| bare(body(b))).collect(),
            region: rows.into_iter().map(bare).collect(),
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
