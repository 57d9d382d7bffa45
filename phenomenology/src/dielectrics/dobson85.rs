//! Soil, 1.4-18 GHz: the semi-empirical mixture of Dobson with Peplinski's conductivity.

use super::constants::VACUUM_PERMITTIVITY_F_M;
use super::constants::ZERO_CELSIUS_K;
use super::klein_swift77::static_permittivity;
use super::model::{Bands, Model, Range, SAME_FORMULA, permittivity_of};
use super::soil_water::{ALPHA, SOIL_PARTICLE_DENSITY_KG_M3, SOLID_PERMITTIVITY, debye_water};
use super::state::{MaterialState, Parameter};
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "dobson85",
    describes: "moist soil by texture",
    reference: "Dobson, Ulaby, Hallikainen & El-Rayes 1985, IEEE TGRS 23, 35; conductivity \
                Peplinski, Ulaby & Dobson 1995, IEEE TGRS 33, 803",
    bands: Bands::fixed(1.4, 18.0),
    ranges: &[Range::new(Parameter::Temperature, 273.15, 313.15)],
    extension: SAME_FORMULA,
    formula: |q| Ok(soil_permittivity_dobson85(q.freq_ghz(), q.state)),
};

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
    let water = debye_water(freq_ghz, t, static_permittivity(t));
    let conductivity = (0.0467 + 0.2204 * rho_b - 0.4111 * s + 0.6614 * c).max(0.0);
    let conduction = conductivity * (rho_s - rho_b)
        / (TAU * freq_ghz * 1e9 * VACUUM_PERMITTIVITY_F_M * rho_s * mv);
    let real = dry + mv.powf(beta_real) * water.re.powf(ALPHA) - mv;
    let loss = mv.powf(beta_loss) * (-water.im + conduction).powf(ALPHA);
    permittivity_of(real.powf(1.0 / ALPHA), loss.powf(1.0 / ALPHA))
}
