//! Moist soil, by its texture, density and water.

use super::model::permittivity_of;
use super::state::MaterialState;
use super::water::{E_INF, pure_water_klein_swift77};
use crate::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Density of the solid particles of soil, kg/m3.
pub const SOIL_PARTICLE_DENSITY_KG_M3: f64 = 2664.0;
/// Permittivity of the solid particles.
const SOLID_PERMITTIVITY: f64 = 4.7;
/// Shape exponent of the mixing rule of Dobson et al. 1985.
const ALPHA: f64 = 0.65;

/// Free water in soil at `t` degrees Celsius: single Debye water with a given static permittivity, no conduction.
fn debye_water(freq_ghz: f64, t: f64, static_permittivity: f64) -> Complex64 {
    let two_pi_tau_s = 1.1109e-10 - 3.824e-12 * t + 6.938e-14 * t * t - 5.096e-16 * t * t * t;
    E_INF + (static_permittivity - E_INF) / Complex64::new(1.0, freq_ghz * 1e9 * two_pi_tau_s)
}

/// Permittivity of moist soil, frequency in GHz.
///
/// The conductivity fit turns negative for nearly pure sand; it is held at zero there.
///
/// # Reference
/// Dobson et al. 1985, eqs. 22-32; Peplinski et al. 1995, eq. 10.
#[must_use]
pub fn soil_permittivity_dobson85(freq_ghz: f64, soil: &MaterialState) -> Complex64 {
    let (s, c, mv) = (soil.sand, soil.clay, soil.moisture);
    let rho_b = soil.density_kg_m3 * 1e-3;
    let rho_s = SOIL_PARTICLE_DENSITY_KG_M3 * 1e-3;
    let t = soil.temperature_k - ZERO_CELSIUS_K;
    let beta_real = 1.2748 - 0.519 * s - 0.152 * c;
    let beta_loss = 1.337_97 - 0.603 * s - 0.166 * c;
    let dry = 1.0 + rho_b / rho_s * (SOLID_PERMITTIVITY.powf(ALPHA) - 1.0);
    if mv == 0.0 {
        return permittivity_of(dry.powf(1.0 / ALPHA), 0.0);
    }
    let water = debye_water(freq_ghz, t, pure_water_klein_swift77(t));
    let conductivity = (0.0467 + 0.2204 * rho_b - 0.4111 * s + 0.6614 * c).max(0.0);
    let conduction = conductivity * (rho_s - rho_b) / (TAU * freq_ghz * 1e9 * VACUUM_PERMITTIVITY_F_M * rho_s * mv);
    let real = dry + mv.powf(beta_real) * water.re.powf(ALPHA) - mv;
    let loss = mv.powf(beta_loss) * (-water.im + conduction).powf(ALPHA);
    permittivity_of(real.powf(1.0 / ALPHA), loss.powf(1.0 / ALPHA))
}

/// Single Debye water of the model, frequency in GHz, temperature in Celsius.
#[must_use]
pub fn soil_water_ulaby86(freq_ghz: f64, celsius: f64) -> Complex64 {
    let t = celsius;
    debye_water(freq_ghz, t, 87.74 - 0.400_08 * t + 9.398e-4 * t * t + 1.41e-6 * t * t * t)
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

/// Refractive index `n - j k` of one kind of soil water.
fn water_index(freq_ghz: f64, eps0: f64, tau_s: f64, conductivity: f64) -> Complex64 {
    let w = TAU * freq_ghz * 1e9;
    let eps = E_INF + (eps0 - E_INF) / Complex64::new(1.0, w * tau_s) - Complex64::new(0.0, conductivity / (w * VACUUM_PERMITTIVITY_F_M));
    eps.sqrt()
}

/// Permittivity of moist soil: frequency in GHz, water volume fraction, clay mass fraction.
///
/// # Reference
/// Mironov et al. 2009, eqs. 1-8, coefficients in per cent of clay.
#[must_use]
pub fn soil_permittivity_mironov09(freq_ghz: f64, moisture: f64, clay: f64) -> Complex64 {
    let c = 100.0 * clay;
    let dry = Complex64::new(1.634 - 5.39e-3 * c + 2.748e-5 * c * c, -(0.039_52 - 4.038e-4 * c));
    let bound_limit = 0.028_63 + 3.0673e-3 * c;
    let bound = water_index(freq_ghz, 79.8 - 0.854 * c + 3.27e-3 * c * c, 1.062e-11 + 3.45e-14 * c, 0.3112 + 4.67e-3 * c);
    let free = water_index(freq_ghz, 100.0, 8.5e-12, 0.3631 + 0.012_17 * c);
    let index = dry + (bound - 1.0) * moisture.min(bound_limit) + (free - 1.0) * (moisture - bound_limit).max(0.0);
    index * index
}

#[cfg(test)]
mod tests {
    use super::*;

    // Dobson's model is an independent model of the same soils. The two models differ by no more than measured soils do.
    #[test]
    fn is_of_the_size_of_dobson() {
        let soil = super::super::Material::by_name("soil").unwrap();
        let mut state = soil.state();
        soil.set_texture(&mut state, "loam").unwrap();
        for f in [1.4, 5.0, 10.0, 18.0] {
            for mv in [0.05, 0.15, 0.3] {
                state.moisture = mv;
                let ours = soil_permittivity_mironov09(f, mv, state.clay);
                let dobson = soil_permittivity_dobson85(f, &state);
                let ratio = ours.re / dobson.re;
                assert!((0.7..1.3).contains(&ratio), "{f} GHz {mv}: {ours} {dobson}");
                assert!(ours.im < 0.0);
            }
        }
    }

    #[test]
    fn is_continuous_where_free_water_begins() {
        let limit = 0.028_63 + 3.0673e-3 * 20.0;
        let below = soil_permittivity_mironov09(10.0, limit - 1e-9, 0.2);
        let above = soil_permittivity_mironov09(10.0, limit + 1e-9, 0.2);
        assert!((below - above).norm() < 1e-6);
    }
}
