//! Dry snow: Polder and van Santen mixing with the depolarisation factors of Maetzler.

use super::constants::ICE_DENSITY_KG_M3;
use super::error::DielectricError;
use super::maetzler06::ice_permittivity_maetzler06;
use super::mixing::polder_van_santen46;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "maetzler96",
    describes: "dry snow (absorption only: grain scattering, which matters above 30 GHz, is not in it)",
    reference: "Maetzler 1996, IEEE Trans. Geosci. Remote Sens. 34, 573",
    bands: Bands::fixed(0.01, 1000.0),
    ranges: &[
        Range::new(Parameter::Temperature, 200.0, 273.15),
        Range::new(Parameter::Density, 0.0, 916.7),
    ],
    extension: SAME_FORMULA,
    formula: |q| {
        dry_snow_permittivity_maetzler96(q.freq_ghz(), q.state.temperature_k, q.state.density_kg_m3)
    },
};

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
/// [`DielectricError::NoConvergence`] of the mixing formula.
///
/// # Reference
/// Maetzler 1996 for the grain shape; the ice is Maetzler 2006.
pub fn dry_snow_permittivity_maetzler96(
    freq_ghz: f64,
    temperature_k: f64,
    density_kg_m3: f64,
) -> Result<Complex64, DielectricError> {
    let v = density_kg_m3 / ICE_DENSITY_KG_M3;
    polder_van_santen46(
        Complex64::new(1.0, 0.0),
        ice_permittivity_maetzler06(freq_ghz, temperature_k),
        v,
        grain_factors_maetzler96(v),
    )
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
}
