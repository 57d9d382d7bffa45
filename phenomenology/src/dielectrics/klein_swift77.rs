//! Sea water below 10 GHz: the single Debye model of Klein and Swift.

use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use crate::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "klein-swift77",
    describes: "sea water, one relaxation, the model of its period",
    reference: "Klein & Swift 1977, IEEE Trans. Antennas Propag. 25, 104",
    bands: Bands::fixed(0.1, 10.0),
    ranges: &[Range::new(Parameter::Temperature, 271.15, 308.15), Range::new(Parameter::Salinity, 0.0, 40.0)],
    extension: SAME_FORMULA,
    formula: |q| Ok(sea_water_permittivity_klein_swift77(q.freq_ghz(), q.state.temperature_k, q.state.salinity_psu)),
};

/// Permittivity of water at high frequencies.
pub(super) const E_INF: f64 = 4.9;

/// Static permittivity of pure water at `t` degrees Celsius.
#[must_use]
pub(super) fn static_permittivity(t: f64) -> f64 {
    87.134 - 0.1949 * t - 1.276e-2 * t * t + 2.491e-4 * t * t * t
}

/// Permittivity of sea water, frequency in GHz, temperature in K, salinity in psu.
///
/// # Reference
/// Klein & Swift 1977; up to 10 GHz.
#[must_use]
pub fn sea_water_permittivity_klein_swift77(freq_ghz: f64, temperature_k: f64, salinity_psu: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let s = salinity_psu;
    let w = TAU * freq_ghz * 1e9;
    let es = static_permittivity(t) * (1.0 + 1.613e-5 * s * t - 3.656e-3 * s + 3.21e-5 * s * s - 4.232e-7 * s * s * s);
    let tau = (1.768e-11 - 6.086e-13 * t + 1.104e-14 * t * t - 8.111e-17 * t * t * t)
        * (1.0 + 2.282e-5 * s * t - 7.638e-4 * s - 7.76e-6 * s * s + 1.105e-8 * s * s * s);
    let d = 25.0 - t;
    let exponent = d * (2.0333e-2 + 1.266e-4 * d + 2.464e-6 * d * d - s * (1.849e-5 - 2.551e-7 * d + 2.551e-8 * d * d));
    let conductivity = s * (0.182_521 - 1.461_92e-3 * s + 2.093_24e-5 * s * s - 1.282_05e-7 * s * s * s) * (-exponent).exp();
    E_INF + (es - E_INF) / Complex64::new(1.0, w * tau) - Complex64::new(0.0, conductivity / (w * VACUUM_PERMITTIVITY_F_M))
}
