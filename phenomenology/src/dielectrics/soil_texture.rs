//! Soil textures by name.

use super::csv_table::read_table;
use super::error::{DielectricError, unknown};
use serde::Deserialize;
use std::sync::OnceLock;

const TABLE: &str = include_str!("../../tables/materials/soil_textures.csv");
const TABLE_NAME: &str = "soil_textures.csv";

/// A soil texture: the mass fractions of its mineral part.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct SoilTexture {
    /// Class name, such as `sandy_loam`.
    #[serde(rename = "class")]
    pub name: String,
    /// Mass fraction of sand.
    #[serde(rename = "sand_fraction")]
    pub sand: f64,
    /// Mass fraction of silt.
    #[serde(rename = "silt_fraction")]
    pub silt: f64,
    /// Mass fraction of clay.
    #[serde(rename = "clay_fraction")]
    pub clay: f64,
}

impl SoilTexture {
    /// The texture of this name; `-` and `_` are the same, and `silt-loam` is `silt_loam_3`.
    ///
    /// # Errors
    /// [`DielectricError::Unknown`] with the known names.
    pub fn by_name(name: &str) -> Result<&'static Self, DielectricError> {
        let mut wanted = name.trim().to_ascii_lowercase().replace(['-', ' '], "_");
        if wanted == "silt_loam" {
            wanted.push_str("_3");
        }
        let textures = Self::all()?;
        textures.iter().find(|t| t.name == wanted).ok_or_else(|| unknown("soil texture", name, textures.iter().map(|t| t.name.as_str())))
    }

    /// Every texture of the table.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if the built-in table is damaged.
    pub fn all() -> Result<&'static [Self], DielectricError> {
        static ROWS: OnceLock<Result<Vec<SoilTexture>, String>> = OnceLock::new();
        read_table(&ROWS, TABLE, TABLE_NAME)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_add_up_to_one() {
        for t in SoilTexture::all().unwrap() {
            assert!((t.sand + t.silt + t.clay - 1.0).abs() < 1e-12, "{t:?}");
        }
    }

    #[test]
    fn names_are_forgiving_and_errors_list_them() {
        assert_eq!(SoilTexture::by_name("Silty-Clay").unwrap().clay, 0.474);
        assert_eq!(SoilTexture::by_name("silt loam").unwrap().sand, 0.306);
        let error = SoilTexture::by_name("gravel").unwrap_err().to_string();
        assert!(error.contains("gravel") && error.contains("sandy_loam"));
    }
}
