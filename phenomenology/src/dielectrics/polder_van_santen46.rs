//! Wet snow above 37 GHz: water mixed into dry snow.

use super::constants::ZERO_CELSIUS_K;
use super::error::DielectricError;
use super::liebe91::water_permittivity_liebe91;
use super::maetzler96::dry_snow_permittivity_maetzler96;
use super::mixing::{SPHERE, polder_van_santen46};
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "polder-van-santen46",
    describes: "wet snow at 0 C, spheres of water in dry snow",
    reference: "Polder & van Santen 1946, Physica 12, 257; water Liebe 1991, snow Maetzler 1996",
    bands: Bands::fixed(1.0, 1000.0),
    ranges: &[
        Range::new(Parameter::Moisture, 0.0, 0.2),
        Range::new(Parameter::Density, 0.0, 916.7),
    ],
    extension: SAME_FORMULA,
    formula: |q| {
        wet_snow_permittivity_polder_van_santen46(
            q.freq_ghz(),
            q.state.density_kg_m3,
            q.state.moisture,
        )
    },
};

/// Permittivity of wet snow: frequency in GHz, dry density in kg/m3, water volume fraction.
///
/// Snow and water are at the melting point; other temperatures have no wet snow.
///
/// # Errors
/// [`DielectricError::NoConvergence`] of the mixing formula.
pub fn wet_snow_permittivity_polder_van_santen46(
    freq_ghz: f64,
    dry_density_kg_m3: f64,
    moisture: f64,
) -> Result<Complex64, DielectricError> {
    let snow = dry_snow_permittivity_maetzler96(freq_ghz, ZERO_CELSIUS_K, dry_density_kg_m3)?;
    let water = water_permittivity_liebe91(freq_ghz, ZERO_CELSIUS_K);
    polder_van_santen46(snow, water, moisture, SPHERE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_water_it_is_dry_snow() {
        let wet = wet_snow_permittivity_polder_van_santen46(94.0, 250.0, 0.0).unwrap();
        let dry = dry_snow_permittivity_maetzler96(94.0, 273.15, 250.0).unwrap();
        assert!((wet - dry).norm() < 1e-12);
    }

    #[test]
    fn loss_grows_with_wetness() {
        let mut last = 0.0;
        for mv in [0.01, 0.03, 0.06, 0.12] {
            let eps = wet_snow_permittivity_polder_van_santen46(94.0, 250.0, mv).unwrap();
            assert!(-eps.im > last);
            last = -eps.im;
        }
    }
}
