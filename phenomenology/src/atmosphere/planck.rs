//! Thermal radiance and the two brightness temperatures.
//!
//! Radiative transfer adds radiances. Radiance here is the photon occupation number `B = 1/(exp(x/T) - 1)` with `x = h f / k`, which is
//! dimensionless. It is converted to a temperature only at the end.

use crate::constants::{BOLTZMANN_J_PER_K, PLANCK_J_S};

/// Temperature of the cosmic background, K.
///
/// # Reference
/// Fixsen et al. 1996, ApJ 473, 576 (2.728 K).
pub const COSMIC_BACKGROUND_K: f64 = 2.728;

/// One over the radiance below which [`planck_temperature_k`] sums a series, exact to rounding and four times as fast as the logarithm.
const WARM: f64 = 1.0 / 32.0;

/// Coefficients of `x / ln(1 + x)` in powers of `x`: 1 and those of Gregory (Jordan 1947, Calculus of finite differences, section 89).
const GREGORY: [f64; 9] =
    [1.0, 1.0 / 2.0, -1.0 / 12.0, 1.0 / 24.0, -19.0 / 720.0, 3.0 / 160.0, -863.0 / 60480.0, 275.0 / 24192.0, -33953.0 / 3_628_800.0];

/// The quantum temperature `x = h f / k` in K (0.0479924 K per GHz).
#[must_use]
pub fn quantum_temperature_k(freq_ghz: f64) -> f64 {
    PLANCK_J_S / BOLTZMANN_J_PER_K * 1e9 * freq_ghz
}

/// Radiance `B` (photon occupation number) of a black body.
///
/// # Reference
/// Planck 1901; `B = 1/(exp(x/T) - 1)`.
#[must_use]
pub fn black_body_radiance(freq_ghz: f64, temperature_k: f64) -> f64 {
    1.0 / (quantum_temperature_k(freq_ghz) / temperature_k).exp_m1()
}

/// Planck brightness temperature in K: the black body that has radiance `B`.
#[must_use]
pub fn planck_temperature_k(freq_ghz: f64, radiance: f64) -> f64 {
    if radiance <= 0.0 {
        return 0.0;
    }
    let x = 1.0 / radiance;
    if x < WARM {
        return quantum_temperature_k(freq_ghz) * radiance * GREGORY.iter().rev().fold(0.0, |sum, g| sum * x + g);
    }
    quantum_temperature_k(freq_ghz) / x.ln_1p()
}

/// Rayleigh-Jeans brightness temperature `x B` in K, which is linear in radiance.
#[must_use]
pub fn rayleigh_jeans_temperature_k(freq_ghz: f64, radiance: f64) -> f64 {
    quantum_temperature_k(freq_ghz) * radiance
}

/// Radiance `B` of a Rayleigh-Jeans temperature in K.
#[must_use]
pub fn radiance_of_rayleigh_jeans(freq_ghz: f64, rj_k: f64) -> f64 {
    rj_k / quantum_temperature_k(freq_ghz)
}

/// Planck brightness temperature in K of a Rayleigh-Jeans temperature in K.
#[must_use]
pub fn planck_of_rayleigh_jeans_k(freq_ghz: f64, rj_k: f64) -> f64 {
    planck_temperature_k(freq_ghz, radiance_of_rayleigh_jeans(freq_ghz, rj_k))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantum_temperature_of_one_gigahertz() {
        assert!((quantum_temperature_k(1.0) - 0.047_992_4).abs() < 1e-7);
    }

    #[test]
    fn planck_temperature_inverts_radiance() {
        for freq in [1.0, 94.0, 340.0, 1000.0] {
            for t in [2.728, 50.0, 290.0] {
                let back = planck_temperature_k(freq, black_body_radiance(freq, t));
                assert!((back - t).abs() < 1e-9 * t, "{freq} {t} {back}");
            }
        }
    }

    #[test]
    fn rayleigh_jeans_is_half_a_quantum_low_when_warm() {
        let rj = rayleigh_jeans_temperature_k(94.0, black_body_radiance(94.0, 290.0));
        assert!((290.0 - rj - quantum_temperature_k(94.0) / 2.0).abs() < 0.01);
    }

    #[test]
    fn the_series_joins_the_logarithm() {
        for x in [1e-6, 1e-3, 0.01, 0.02, WARM * (1.0 - 1e-12)] {
            let plain = quantum_temperature_k(94.0) / f64::ln_1p(x);
            assert!((planck_temperature_k(94.0, 1.0 / x) / plain - 1.0).abs() < 1e-15, "{x}");
        }
    }

    #[test]
    fn no_radiance_is_zero_kelvin() {
        assert_eq!(planck_temperature_k(94.0, 0.0), 0.0);
    }
}
