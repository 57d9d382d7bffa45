//! Free water in soil: the single Debye model that the soil models use.

use super::klein_swift77::E_INF;
use num_complex::Complex64;

/// Density of the solid particles of soil, kg/m3.
pub const SOIL_PARTICLE_DENSITY_KG_M3: f64 = 2664.0;
/// Permittivity of the solid particles.
pub(super) const SOLID_PERMITTIVITY: f64 = 4.7;
/// Shape exponent of the mixing rule of Dobson et al. 1985.
pub(super) const ALPHA: f64 = 0.65;

/// `2 pi tau` of free water at `t` degrees Celsius, s.
fn two_pi_tau_s(t: f64) -> f64 {
    1.1109e-10 - 3.824e-12 * t + 6.938e-14 * t * t - 5.096e-16 * t * t * t
}

/// Single Debye water with a given static permittivity, no conduction.
#[must_use]
pub(super) fn debye_water(freq_ghz: f64, celsius: f64, static_permittivity: f64) -> Complex64 {
    let x = freq_ghz * 1e9 * two_pi_tau_s(celsius);
    E_INF + (static_permittivity - E_INF) / Complex64::new(1.0, x)
}
