//! Brine in sea ice: the Debye model of Stogryn and Desargant.

use super::constants::{VACUUM_PERMITTIVITY_F_M, ZERO_CELSIUS_K};
use super::model::{Bands, Model, Range, SAME_FORMULA};
use super::state::Parameter;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "stogryn-desargant85",
    describes: "brine in equilibrium with ice (the liquid alone, not the mixture)",
    reference: "Stogryn & Desargant 1985, IEEE Trans. Antennas Propag. 33, 523",
    bands: Bands::fixed(1.0, 1000.0),
    ranges: &[Range::new(Parameter::Temperature, 223.15, 273.15)],
    extension: SAME_FORMULA,
    formula: |q| {
        Ok(brine_permittivity_stogryn_desargant85(
            q.freq_ghz(),
            q.state.temperature_k,
        ))
    },
};

/// Permittivity of brine at its freezing point, frequency in GHz, temperature in K.
///
/// # Reference
/// Stogryn & Desargant 1985, eqs. 1-5. Their measurements span 7.5-40 GHz and -2.8 to -25 C.
#[must_use]
pub fn brine_permittivity_stogryn_desargant85(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let t = temperature_k - ZERO_CELSIUS_K;
    let es = (939.66 - 19.068 * t) / (10.737 - t);
    let two_pi_tau_ns = 0.1099 + 1.3603e-3 * t + 2.0894e-4 * t * t + 2.8167e-6 * t * t * t;
    let e_inf = (82.79 + 8.19 * t * t) / (15.68 + t * t);
    let conductivity = if t >= -22.9 {
        -t * (0.5193 + 0.087_55 * t).exp()
    } else {
        -t * (1.0334 + 0.11 * t).exp()
    };
    e_inf + (es - e_inf) / Complex64::new(1.0, two_pi_tau_ns * freq_ghz)
        - Complex64::new(
            0.0,
            conductivity / (TAU * freq_ghz * 1e9 * VACUUM_PERMITTIVITY_F_M),
        )
}
