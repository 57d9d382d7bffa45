//! Snow: dry, and wet at the melting point.

use super::error::DielectricError;
use super::ice::ice_permittivity_maetzler06;
use super::mixing::{SPHERE, polder_van_santen46};
use super::model::permittivity_of;
use super::water::water_permittivity_liebe91;
use crate::constants::{ICE_DENSITY_KG_M3, ZERO_CELSIUS_K};
use num_complex::Complex64;

/// Depolarisation factors of the ice grains at ice volume fraction `v`.
///
/// # Reference
/// Maetzler 1996, eqs. 10-12.
#[must_use]
pub fn grain_factors_maetzler96(v: f64) -> [f64; 3] {
    let a = if v < 0.33 {
        0.1 + 0.5 * v
    } else if v < 0.71 {
        0.18 + 3.24 * (v - 0.49) * (v - 0.49)
    } else {
        1.0 / 3.0
    };
    [a, a, 1.0 - 2.0 * a]
}

/// Permittivity of dry snow, frequency in GHz, temperature in K, density in kg/m3.
///
/// # Errors
/// As [`polder_van_santen46`].
///
/// # Reference
/// Maetzler 1996 for the grain shape; the ice is Maetzler 2006.
pub fn dry_snow_permittivity_maetzler96(freq_ghz: f64, temperature_k: f64, density_kg_m3: f64) -> Result<Complex64, DielectricError> {
    let v = density_kg_m3 / ICE_DENSITY_KG_M3;
    polder_van_santen46(Complex64::new(1.0, 0.0), ice_permittivity_maetzler06(freq_ghz, temperature_k), v, grain_factors_maetzler96(v))
}

/// Effective relaxation frequency of the water in snow, GHz.
const RELAXATION_GHZ: f64 = 9.07;

/// Permittivity of wet snow: frequency in GHz, dry density in kg/m3, water volume fraction.
///
/// # Reference
/// Hallikainen et al. 1986; 3-37 GHz, water 1-12 %, dry density 0.09-0.38 g/cm3.
#[must_use]
pub fn wet_snow_permittivity_hallikainen86(freq_ghz: f64, dry_density_kg_m3: f64, moisture: f64) -> Complex64 {
    let f = freq_ghz;
    let rho = dry_density_kg_m3 * 1e-3;
    let mv = 100.0 * moisture;
    let a1 = 0.78 + 0.03 * f - 5.8e-4 * f * f;
    let a2 = 0.97 - 3.9e-3 * f + 3.9e-4 * f * f;
    let b1 = 0.31 - 0.05 * f + 8.7e-4 * f * f;
    let ratio = f / RELAXATION_GHZ;
    let y = mv.powf(1.31) / (1.0 + ratio * ratio);
    permittivity_of(a1 * (1.0 + 1.83 * rho + 0.02 * mv.powf(1.015)) + b1 + 0.073 * a1 * y, 0.073 * a2 * y * ratio)
}

/// Permittivity of wet snow: frequency in GHz, dry density in kg/m3, water volume fraction.
///
/// Snow and water are at the melting point; other temperatures have no wet snow.
///
/// # Errors
/// As [`polder_van_santen46`].
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

    // The quick rule eps' = 1 + 1.9 rho holds to a few per cent below 0.5 g/cm3.
    #[test]
    fn real_part_follows_the_quick_rule() {
        for rho in [100.0, 200.0, 300.0, 400.0] {
            let eps = dry_snow_permittivity_maetzler96(10.0, 263.15, rho).unwrap();
            let quick = 1.0 + 1.9e-3 * rho;
            assert!((eps.re / quick - 1.0).abs() < 0.04, "{rho}: {eps}");
        }
    }

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
