//! Absorption by oxygen, water vapour and nitrogen. Each file holds one model, and [`GAS_MODELS`] has a row for each.
//!
//! A model computes the strengths, widths and mixing of its lines once for a state of air. The resulting [`GasSpectrum`] is then evaluated
//! at any number of frequencies.

mod liebe;
mod lines;
mod model;
mod mpm89;
mod mpm93;
mod nitrogen;
mod table;

pub use lines::{DebyeOxygen, GasAbsorption, GasSpectrum, NEPER_PER_DECIBEL, SpectralLine, WaterContinuum};
pub use model::GasModel;
pub use nitrogen::nitrogen_refractivity_ppm;
pub use table::{GAS_MODELS, GasModelEntry, gas_model};
