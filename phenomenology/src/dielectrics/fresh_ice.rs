//! The real part and the low-frequency loss, which both models of fresh ice use.

use super::model::permittivity_of;
use crate::constants::ZERO_CELSIUS_K;
use num_complex::Complex64;

/// Real part of the permittivity of pure ice.
///
/// # Reference
/// Maetzler & Wegmueller 1987, J. Phys. D 20, 1623.
#[must_use]
pub(super) fn ice_real_part(temperature_k: f64) -> f64 {
    3.1884 + 9.1e-4 * (temperature_k - ZERO_CELSIUS_K)
}

/// Permittivity of pure ice with the loss `alpha/f + beta f`. Both models have the same `alpha`.
#[must_use]
pub(super) fn ice_from_beta(freq_ghz: f64, temperature_k: f64, beta: f64) -> Complex64 {
    let excess = 300.0 / temperature_k - 1.0;
    let alpha = (0.005_04 + 0.0062 * excess) * (-22.1 * excess).exp();
    permittivity_of(ice_real_part(temperature_k), alpha / freq_ghz + beta * freq_ghz)
}
