//! Fresh ice: Hufford's 1991 loss.

use super::fresh_ice::ice_from_beta;
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "hufford91",
    describes: "pure ice",
    reference: "Hufford 1991, Int. J. Infrared Millim. Waves 12, 677",
    bands: Bands::fixed(0.01, 1000.0),
    ranges: &[Range::new(Parameter::Temperature, 200.0, 273.15)],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(ice_permittivity_hufford91(
            q.freq_ghz(),
            q.state.temperature_k,
        ))
    },
};

/// Permittivity of pure ice, frequency in GHz, temperature in K.
///
/// # Reference
/// Hufford 1991; 0.01-1000 GHz, 200-273 K.
#[must_use]
pub fn ice_permittivity_hufford91(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let theta = 300.0 / temperature_k;
    let excess = theta - 1.0;
    let resonance = theta / (excess + 0.0073);
    let beta = (0.502 - 0.131 * excess / theta) * 1e-4 + 0.542e-6 * resonance * resonance;
    ice_from_beta(freq_ghz, temperature_k, beta)
}
