//! Fresh water, also supercooled: Turner, Kneifel and Cadeddu.

use super::constants::ZERO_CELSIUS_K;
use super::model::{Bands, Model, Range, SAME_FORMULA, permittivity_of};
use super::state::Parameter;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "turner16",
    describes: "fresh and supercooled water, two relaxations",
    reference: "Turner, Kneifel & Cadeddu 2016, J. Atmos. Oceanic Technol. 33, 33",
    bands: Bands::fixed(0.5, 500.0),
    ranges: &[Range::new(Parameter::Temperature, 240.15, 323.15)],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(water_permittivity_turner16(
            q.freq_ghz(),
            q.state.temperature_k,
        ))
    },
};

/// `a` (amplitude), `b` (1/K), `c` (s), `d` (K) of the two relaxations.
const RELAXATIONS: [[f64; 4]; 2] = [
    [81.11, 4.434e-3, 1.302e-13, 662.7],
    [2.025, 1.073e-2, 1.012e-14, 608.9],
];
/// Critical temperature of the relaxation times, K below zero Celsius.
const CRITICAL_K: f64 = 134.2;

/// Permittivity of fresh water, frequency in GHz, temperature in K.
///
/// # Reference
/// Turner, Kneifel & Cadeddu 2016; to 500 GHz.
#[must_use]
pub fn water_permittivity_turner16(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let w = TAU * freq_ghz * 1e9;
    let mut real = 87.9144 - 0.404_399 * t + 9.587_26e-4 * t * t - 1.328_02e-6 * t * t * t;
    let mut loss = 0.0;
    for [a, b, c, d] in RELAXATIONS {
        let amplitude = a * (-b * t).exp();
        let tau = c * (d / (t + CRITICAL_K)).exp();
        let wt = w * tau;
        real -= wt * wt * amplitude / (1.0 + wt * wt);
        loss += wt * amplitude / (1.0 + wt * wt);
    }
    permittivity_of(real, loss)
}
