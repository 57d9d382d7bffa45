//! Metals: conduction alone.

use super::model::{Bands, Model, SAME_FORMULA, no_constants};
use super::spec::Constants;
use crate::constants::VACUUM_PERMITTIVITY_F_M;
use num_complex::Complex64;
use std::f64::consts::TAU;

/// Table row.
pub(super) const MODEL: Model = Model {
    name: "conductor",
    describes: "metals, conduction only",
    reference: "Drude limit below the collision rate: eps = 1 - j sigma/(2 pi f eps0)",
    bands: Bands::fixed(0.001, 1000.0),
    ranges: &[],
    extension: SAME_FORMULA,
    formula: |q| match q.constants {
        Constants::Conductivity(sigma) => Ok(conductor_permittivity(q.freq_hz, sigma)),
        _ => Err(no_constants(q.material, &MODEL)),
    },
};

/// Permittivity of a conductor: frequency in Hz, conductivity in S/m.
#[must_use]
pub fn conductor_permittivity(freq_hz: f64, conductivity_s_m: f64) -> Complex64 {
    Complex64::new(1.0, -conductivity_s_m / (TAU * freq_hz * VACUUM_PERMITTIVITY_F_M))
}
