//! The built-in table of models and materials.

use super::error::{DielectricError, unknown};
use super::material::Material;
use super::model::Model;
use serde::Deserialize;
use std::sync::LazyLock;

#[derive(Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "'de: 'static"))]
struct Tables {
    model: Vec<Model>,
    material: Vec<Material>,
}

static TABLES: LazyLock<Result<Tables, String>> =
    LazyLock::new(|| toml::from_str(include_str!("../../tables/materials/materials.toml")).map_err(|e| e.to_string()));

fn tables() -> Result<&'static Tables, DielectricError> {
    TABLES.as_ref().map_err(|message| DielectricError::Table { table: "materials.toml", message: message.clone() })
}

/// The name as the table writes it: `_` and `-` are the same.
fn plain(name: &str) -> String {
    name.trim().to_ascii_lowercase().replace('_', "-")
}

impl Model {
    /// The model of this name; `_` and `-` are the same.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`] with the known names.
    pub fn by_name(name: &str) -> Result<&'static Self, DielectricError> {
        let (models, wanted) = (&tables()?.model, plain(name));
        models.iter().find(|m| m.name == wanted).ok_or_else(|| unknown("permittivity model", name, models.iter().map(|m| m.name)))
    }

    /// Every model, in table order; none if the built-in table is damaged.
    #[must_use]
    pub fn all() -> &'static [Self] {
        tables().map_or(&[], |t| &t.model)
    }
}

impl Material {
    /// The material of this name or alias; `_` and `-` are the same.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`] with the known names.
    pub fn by_name(name: &str) -> Result<&'static Self, DielectricError> {
        let (materials, wanted) = (&tables()?.material, plain(name));
        let found = materials.iter().find(|m| m.name == wanted || m.aliases.contains(&wanted.as_str()));
        found.ok_or_else(|| unknown("material", name, materials.iter().map(|m| m.name)))
    }

    /// Every material, in table order; none if the built-in table is damaged.
    #[must_use]
    pub fn all() -> &'static [Self] {
        tables().map_or(&[], |t| &t.material)
    }
}
