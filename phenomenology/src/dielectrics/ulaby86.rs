//! Soil to 100 GHz: the complex mixture of Ulaby, Moore and Fung.

use super::liebe91::water_permittivity_liebe91;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::soil_water::{ALPHA, debye_water};
use super::state::{MaterialState, Parameter};
use num_complex::Complex64;

const RANGES: &[Range] = &[Range::new(Parameter::Temperature, 273.15, 313.15)];
const REFERENCE: &str = "Ulaby, Moore & Fung 1986, Microwave Remote Sensing III, app. E";

/// Table row: with single Debye water.
pub(super) const MODEL: Model = Model {
    name: "ulaby86",
    describes: "moist soil by texture, single Debye water",
    reference: REFERENCE,
    bands: Bands::fixed(1.0, 100.0),
    ranges: RANGES,
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(soil_permittivity_ulaby86(
            q.state,
            soil_water_ulaby86(q.freq_ghz(), q.celsius()),
        ))
    },
};

/// Table row: with the double Debye water that millimetre waves need.
pub(super) const DOUBLE_DEBYE: Model = Model {
    name: "ulaby86-liebe91",
    describes: "moist soil by texture, double Debye water (Liebe 1991)",
    reference: REFERENCE,
    bands: Bands::fixed(1.0, 1000.0),
    ranges: RANGES,
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(soil_permittivity_ulaby86(
            q.state,
            water_permittivity_liebe91(q.freq_ghz(), q.state.temperature_k),
        ))
    },
};

/// Single Debye water of the model, frequency in GHz, temperature in Celsius.
#[must_use]
pub fn soil_water_ulaby86(freq_ghz: f64, celsius: f64) -> Complex64 {
    let t = celsius;
    debye_water(
        freq_ghz,
        t,
        87.74 - 0.400_08 * t + 9.398e-4 * t * t + 1.41e-6 * t * t * t,
    )
}

/// Permittivity of moist soil that holds the given water.
///
/// # Reference
/// Ulaby, Moore & Fung 1986: `eps^0.65 = 1 + 0.65 rho_b + mv^beta (eps_w^0.65 - 1)`.
#[must_use]
pub fn soil_permittivity_ulaby86(soil: &MaterialState, water: Complex64) -> Complex64 {
    let beta = 1.09 - 0.11 * soil.sand + 0.18 * soil.clay;
    let rho_b = soil.density_kg_m3 * 1e-3;
    let mixture = 1.0 + 0.65 * rho_b + (water.powf(ALPHA) - 1.0) * soil.moisture.powf(beta);
    mixture.powf(1.0 / ALPHA)
}
