//! Fresh water: the double Debye model of Liebe, Hufford and Manabe.

use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "liebe91",
    describes: "fresh water, two relaxations",
    reference: "Liebe, Hufford & Manabe 1991, Int. J. Infrared Millim. Waves 12, 659",
    bands: Bands::fixed(1.0, 1000.0),
    ranges: &[Range::new(Parameter::Temperature, 273.15, 303.15)],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(water_permittivity_liebe91(
            q.freq_ghz(),
            q.state.temperature_k,
        ))
    },
};

/// Permittivity of fresh water, frequency in GHz, temperature in K.
///
/// # Reference
/// Liebe, Hufford & Manabe 1991; 1-1000 GHz, 0-30 C.
#[must_use]
pub fn water_permittivity_liebe91(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let q = 1.0 - 300.0 / temperature_k;
    let e0 = 77.66 - 103.3 * q;
    let e1 = 0.0671 * e0;
    let e2 = 3.52 + 7.52 * q;
    let f1 = 20.2 + 146.4 * q + 316.0 * q * q;
    let f2 = 39.8 * f1;
    e2 + (e1 - e2) / Complex64::new(1.0, freq_ghz / f2)
        + (e0 - e1) / Complex64::new(1.0, freq_ghz / f1)
}
