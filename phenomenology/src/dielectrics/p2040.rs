//! Building materials and ground: Recommendation ITU-R P.2040.

use super::csv_table::read_table;
use super::error::DielectricError;
use super::mixing::{SPHERE, polder_van_santen46};
use super::model::{Band, permittivity_of};
use super::water::water_permittivity_liebe91;
use num_complex::Complex64;
use serde::Deserialize;
use std::sync::OnceLock;

const TABLE: &str = include_str!("../../tables/materials/itu_p2040.csv");
const TABLE_NAME: &str = "itu_p2040.csv";
/// `sigma/f` in S/m/GHz to loss, as the Recommendation rounds it.
const LOSS_PER_CONDUCTIVITY: f64 = 17.98;

/// One row of the table: a material over one band.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct BuildingRow {
    /// Material.
    pub material: String,
    /// Lower end of the band, GHz.
    pub f_min_ghz: f64,
    /// Upper end of the band, GHz.
    pub f_max_ghz: f64,
    /// Real part at 1 GHz.
    pub a: f64,
    /// Exponent of the real part.
    pub b: f64,
    /// Conductivity at 1 GHz, S/m.
    #[serde(rename = "c_s_per_m")]
    pub c: f64,
    /// Exponent of the conductivity.
    pub d: f64,
}

impl BuildingRow {
    fn band(&self) -> Band {
        Band { min_ghz: self.f_min_ghz, max_ghz: self.f_max_ghz }
    }

    fn at(&self, freq_ghz: f64) -> Complex64 {
        permittivity_of(self.a * freq_ghz.powf(self.b), LOSS_PER_CONDUCTIVITY * self.c * freq_ghz.powf(self.d) / freq_ghz)
    }
}

/// The whole table.
///
/// # Errors
/// [`DielectricError::Table`] if the built-in table is damaged.
pub fn building_table() -> Result<&'static [BuildingRow], DielectricError> {
    static ROWS: OnceLock<Result<Vec<BuildingRow>, String>> = OnceLock::new();
    read_table(&ROWS, TABLE, TABLE_NAME)
}

fn rows(key: &str) -> Result<Vec<&'static BuildingRow>, DielectricError> {
    let rows: Vec<_> = building_table()?.iter().filter(|r| r.material == key).collect();
    if rows.is_empty() {
        return Err(DielectricError::Table { table: TABLE_NAME, message: format!("no row for `{key}`") });
    }
    Ok(rows)
}

/// The bands of a material of the table.
pub(super) fn building_bands(key: &str) -> Result<Vec<Band>, DielectricError> {
    Ok(rows(key)?.iter().map(|r| r.band()).collect())
}

/// Permittivity of a material of the table that holds the volume fraction `moisture` of water, frequency in GHz.
pub(super) fn wet_building_permittivity(key: &str, freq_ghz: f64, temperature_k: f64, moisture: f64) -> Result<Complex64, DielectricError> {
    let dry = building_permittivity_p2040(key, freq_ghz)?;
    if moisture == 0.0 {
        return Ok(dry);
    }
    polder_van_santen46(dry, water_permittivity_liebe91(freq_ghz, temperature_k), moisture, SPHERE)
}

/// Permittivity of a material of the table, frequency in GHz.
///
/// Outside the bands, the value at the nearest band edge in `log f` is used, and its real part and loss tangent stay constant.
///
/// # Errors
/// [`DielectricError::Table`] if the table has no such material.
///
/// # Reference
/// ITU-R P.2040. The Recommendation gives no rule outside the bands; the rule here belongs to this crate.
pub fn building_permittivity_p2040(key: &str, freq_ghz: f64) -> Result<Complex64, DielectricError> {
    let rows = rows(key)?;
    let mut nearest = rows[0];
    for row in &rows {
        if row.band().distance(freq_ghz) < nearest.band().distance(freq_ghz) {
            nearest = row;
        }
    }
    let held = if nearest.band().contains(freq_ghz) { freq_ghz } else { freq_ghz.clamp(nearest.f_min_ghz, nearest.f_max_ghz) };
    Ok(nearest.at(held))
}

#[cfg(test)]
mod tests {
    use super::super::model::Extrapolation;
    use super::*;
    use crate::dielectrics::{Constants, Material};

    #[test]
    fn concrete_at_ten_gigahertz() {
        let eps = building_permittivity_p2040("concrete", 10.0).unwrap();
        assert!((eps.re - 5.24).abs() < 1e-12);
        let loss = 17.98 * 0.0462 * 10f64.powf(0.7822) / 10.0;
        assert!((-eps.im - loss).abs() < 1e-12);
    }

    #[test]
    fn outside_the_band_the_edge_is_held() {
        let asphalt = Material::by_name("asphalt").unwrap();
        let state = asphalt.state();
        let edge = asphalt.permittivity(&state, 40e9).unwrap();
        let error = asphalt.permittivity(&state, 94e9).unwrap_err().to_string();
        assert!(error.contains("1-40 GHz"), "{error}");
        let held = asphalt.evaluate(None, &state, 94e9, Extrapolation::Documented).unwrap();
        assert!(held.extended);
        assert!((held.eps - edge).norm() < 1e-12);
        // In the gap of concrete, 100-110 GHz, the nearer edge counts.
        let low = building_permittivity_p2040("concrete", 101.0).unwrap();
        let high = building_permittivity_p2040("concrete", 109.0).unwrap();
        assert!((low.re - 5.24).abs() < 1e-12 && (high.re - 5.17).abs() < 1e-12);
    }

    #[test]
    fn every_row_of_the_table_is_a_material() {
        for row in building_table().unwrap() {
            let found = Material::all().iter().any(|m| m.constants == Constants::P2040(row.material.as_str()));
            assert!(found, "{}", row.material);
        }
    }

    // The uncertainty of a P.2040 material outside its bands is how far the real parts of the materials with two bands move between them.
    #[test]
    fn the_uncertainty_outside_the_bands_is_that_between_two_bands() {
        let table = building_table().unwrap();
        let pairs = table.windows(2).filter(|w| w[0].material == w[1].material);
        let moved: Vec<f64> = pairs.map(|w| w[1].at(w[1].f_min_ghz).re / w[0].at(w[0].f_max_ghz).re - 1.0).collect();
        let rms = (moved.iter().map(|m| m * m).sum::<f64>() / moved.len() as f64).sqrt();
        println!("{} materials: {moved:.3?}, rms {rms:.4}", moved.len());
        let stated = Material::by_name("asphalt").unwrap().default_model(94e9).unwrap().uncertainty;
        assert!(moved.len() == 8 && (rms - stated).abs() < 1e-3, "{rms} {stated}");
    }

    #[test]
    fn wet_brick_is_lossier() {
        let brick = Material::by_name("brick").unwrap();
        let mut state = brick.state();
        let dry = brick.permittivity(&state, 35e9).unwrap();
        state.moisture = 0.1;
        let wet = brick.permittivity(&state, 35e9).unwrap();
        assert!(wet.re > dry.re && wet.im < dry.im - 0.2, "{dry} {wet}");
    }
}
