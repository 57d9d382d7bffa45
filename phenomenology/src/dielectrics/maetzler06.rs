//! Fresh ice: Maetzler's 2006 loss.

use super::constants::ZERO_CELSIUS_K;
use super::fresh_ice::ice_from_beta;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "maetzler06",
    describes: "pure ice",
    reference: "Maetzler 2006, in Thermal Microwave Radiation (IET), section 5.3",
    bands: Bands::fixed(0.01, 1000.0),
    ranges: &[Range::new(Parameter::Temperature, 200.0, 273.15)],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(ice_permittivity_maetzler06(
            q.freq_ghz(),
            q.state.temperature_k,
        ))
    },
};

/// Permittivity of pure ice, frequency in GHz, temperature in K.
///
/// # Reference
/// Maetzler 2006; 0.01-1000 GHz, 200-273 K.
#[must_use]
pub fn ice_permittivity_maetzler06(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let b = (335.0 / temperature_k).exp();
    let beta = 0.0207 / temperature_k * b / ((b - 1.0) * (b - 1.0))
        + 1.16e-11 * freq_ghz * freq_ghz
        + (-9.963 + 0.0372 * t).exp();
    ice_from_beta(freq_ghz, temperature_k, beta)
}
