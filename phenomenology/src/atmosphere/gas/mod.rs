//! Absorption and refraction by oxygen, water vapour and nitrogen. [`GAS_MODELS`] has a row for each model.
//!
//! A model computes the strengths, widths and mixing of its lines once for a state of air. The resulting [`GasSpectrum`] is then evaluated
//! at any number of frequencies.

mod dispersion;
mod lines;
mod model;
mod nitrogen;

pub use dispersion::{GasRefractivity, static_refractivity_liebe89};
pub use lines::{DebyeOxygen, GasAbsorption, GasSpectrum, NEPER_PER_DECIBEL, SpectralLine};
pub use model::{GAS_MODELS, GasModel, GasModelEntry, gas_model};
pub use nitrogen::nitrogen_refractivity_ppm;
