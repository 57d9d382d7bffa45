//! The models: the formula of each row of the table, and the range in which it holds.

use super::error::DielectricError;
use super::ice::{
    BrinePockets, brine_permittivity_stogryn_desargant85, ice_permittivity_hufford91, ice_permittivity_maetzler06, sea_ice_permittivity,
};
use super::leaf::{leaf_permittivity_maetzler94, leaf_permittivity_ulaby_el_rayes87};
use super::material::{Constants, Material};
use super::model::{Band, Model, permittivity_of};
use super::p2040::{building_bands, wet_building_permittivity};
use super::snow::{dry_snow_permittivity_maetzler96, wet_snow_permittivity_hallikainen86, wet_snow_permittivity_polder_van_santen46};
use super::soil::{soil_permittivity_dobson85, soil_permittivity_mironov09, soil_permittivity_ulaby86, soil_water_ulaby86};
use super::state::MaterialState;
use super::water::{
    sea_water_permittivity_klein_swift77, sea_water_permittivity_meissner_wentz04, sea_water_permittivity_stogryn95,
    water_permittivity_liebe91, water_permittivity_turner16,
};
use crate::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use num_complex::Complex64;
use std::f64::consts::TAU;

impl Model {
    /// The permittivity `eps' - j eps''` by the formula of this model. State and frequency are not checked.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if the material lacks the constants that the model needs; an iteration that does not converge.
    pub(super) fn permittivity(&self, material: &Material, state: &MaterialState, freq_hz: f64) -> Result<Complex64, DielectricError> {
        let f = freq_hz * 1e-9;
        let MaterialState { temperature_k: t, salinity_psu: s, moisture: mv, density_kg_m3: rho, clay, .. } = *state;
        Ok(match (self.name, material.constants) {
            ("liebe91", _) => water_permittivity_liebe91(f, t),
            ("turner16", _) => water_permittivity_turner16(f, t),
            ("stogryn95", _) => sea_water_permittivity_stogryn95(f, t, s),
            ("klein-swift77", _) => sea_water_permittivity_klein_swift77(f, t, s),
            ("meissner-wentz04", _) => sea_water_permittivity_meissner_wentz04(f, t, s),
            ("maetzler06", _) => ice_permittivity_maetzler06(f, t),
            ("hufford91", _) => ice_permittivity_hufford91(f, t),
            ("stogryn-desargant85", _) => brine_permittivity_stogryn_desargant85(f, t),
            ("sea-ice-spheres", _) => sea_ice_permittivity(f, t, s, BrinePockets::Spheres)?,
            ("sea-ice-maxwell-garnett", _) => sea_ice_permittivity(f, t, s, BrinePockets::SpheresApart)?,
            ("sea-ice-needles", _) => sea_ice_permittivity(f, t, s, BrinePockets::Needles)?,
            ("maetzler96", _) => dry_snow_permittivity_maetzler96(f, t, rho)?,
            ("hallikainen86", _) => wet_snow_permittivity_hallikainen86(f, rho, mv),
            ("polder-van-santen46", _) => wet_snow_permittivity_polder_van_santen46(f, rho, mv)?,
            ("dobson85", _) => soil_permittivity_dobson85(f, state),
            ("ulaby86", _) => soil_permittivity_ulaby86(state, soil_water_ulaby86(f, t - ZERO_CELSIUS_K)),
            ("ulaby86-liebe91", _) => soil_permittivity_ulaby86(state, water_permittivity_liebe91(f, t)),
            ("mironov09", _) => soil_permittivity_mironov09(f, mv, clay),
            ("ulaby-el-rayes87", _) => leaf_permittivity_ulaby_el_rayes87(f, mv),
            ("maetzler94", _) => leaf_permittivity_maetzler94(f, t, mv),
            ("p2040", Constants::P2040(key)) => wet_building_permittivity(key, f, t, mv)?,
            ("conductor", Constants::Conductivity(sigma)) => conductor_permittivity(freq_hz, sigma),
            ("frozen-soil-constant" | "paint-constant", Constants::Fixed(real, loss)) => permittivity_of(real, loss),
            _ => {
                let message = format!("`{}` has no constants for model `{}`", material.name, self.name);
                return Err(DielectricError::Table { table: "materials", message });
            }
        })
    }

    /// The frequency bands of the model for one material.
    ///
    /// # Errors
    /// [`DielectricError::Table`] if a built-in table is damaged.
    pub fn bands_of(&self, material: &Material) -> Result<Vec<Band>, DielectricError> {
        match material.constants {
            Constants::P2040(key) if self.bands.is_empty() => building_bands(key),
            _ => Ok(self.bands.clone()),
        }
    }

    /// Checks that frequency and state lie in the range of the model.
    ///
    /// # Errors
    /// [`DielectricError::OutOfBand`] or [`DielectricError::OutOfRange`].
    pub fn check_range(&self, material: &Material, state: &MaterialState, freq_hz: f64) -> Result<(), DielectricError> {
        let bands = self.bands_of(material)?;
        let freq_ghz = freq_hz * 1e-9;
        if !bands.iter().any(|b| b.contains(freq_ghz)) {
            return Err(DielectricError::OutOfBand {
                model: self.name,
                material: material.name,
                freq_ghz,
                bands: bands.iter().map(|b| format!("{}-{}", b.min_ghz, b.max_ghz)).collect::<Vec<_>>().join(", "),
                extension: self.extension,
            });
        }
        for range in &self.ranges {
            let value = state.get(range.parameter);
            let slack = 1e-9 * (1.0 + range.max.abs());
            if value < range.min - slack || value > range.max + slack {
                let (model, range, extension) = (self.name, *range, self.extension);
                return Err(DielectricError::OutOfRange { model, range, value, extension });
            }
        }
        Ok(())
    }
}

/// Permittivity of a conductor: frequency in Hz, conductivity in S/m.
#[must_use]
pub fn conductor_permittivity(freq_hz: f64, conductivity_s_m: f64) -> Complex64 {
    Complex64::new(1.0, -conductivity_s_m / (TAU * freq_hz * VACUUM_PERMITTIVITY_F_M))
}

#[cfg(test)]
mod tests {
    use super::super::material_of_model;
    use super::*;

    #[test]
    fn every_row_of_the_table_has_its_formula() {
        assert_eq!(Model::all().len(), 24);
        for model in Model::all() {
            let material = material_of_model(model.name).unwrap();
            let eps = model.permittivity(material, &material.state(), 10e9).unwrap();
            assert!(eps.re >= 1.0 && eps.im <= 0.0, "{} {eps}", model.name);
        }
    }
}
