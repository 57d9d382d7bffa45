//! What the two models of fresh ice share: the real part and the low-frequency loss.

use super::constants::ZERO_CELSIUS_K;
use super::model::permittivity_of;
use num_complex::Complex64;

/// Real part of the permittivity of pure ice.
///
/// # Reference
/// Maetzler & Wegmueller 1987, J. Phys. D 20, 1623.
#[must_use]
pub(super) fn ice_real_part(temperature_k: f64) -> f64 {
    3.1884 + 9.1e-4 * (temperature_k - ZERO_CELSIUS_K)
}

/// Loss `alpha/f + beta f`, with the `alpha` both models share.
#[must_use]
pub(super) fn ice_from_beta(freq_ghz: f64, temperature_k: f64, beta: f64) -> Complex64 {
    let excess = 300.0 / temperature_k - 1.0;
    let alpha = (0.005_04 + 0.0062 * excess) * (-22.1 * excess).exp();
    permittivity_of(
        ice_real_part(temperature_k),
        alpha / freq_ghz + beta * freq_ghz,
    )
}
