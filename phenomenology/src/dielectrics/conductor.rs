//! Metals: conduction alone.

use super::constants::VACUUM_PERMITTIVITY_F_M;
use super::error::DielectricError;
use super::material::Constants;
use super::model::{Bands, Model, SAME_FORMULA};
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
    formula: |q| match q.material.constants {
        Constants::Conductivity(sigma) => Ok(conductor_permittivity(q.freq_hz, sigma)),
        _ => Err(DielectricError::ModelNotForMaterial {
            model: MODEL.name.to_owned(),
            material: q.material.name,
            known: q.material.model_names().collect::<Vec<_>>().join(", "),
        }),
    },
};

/// Permittivity of a conductor: frequency in Hz, conductivity in S/m.
#[must_use]
pub fn conductor_permittivity(freq_hz: f64, conductivity_s_m: f64) -> Complex64 {
    Complex64::new(
        1.0,
        -conductivity_s_m / (TAU * freq_hz * VACUUM_PERMITTIVITY_F_M),
    )
}
