//! Attenuation by rain, a power law `k R^alpha`, and its refractivity. Each file holds one model, and [`RAIN_MODELS`] has a row for each.
//!
//! The transfer uses extinction as absorption. This is an upper bound of the emission of rain.

mod itu_p838;
mod liebe89;
mod model;
mod olsen78;
mod table;

pub use itu_p838::ItuP838;
pub use liebe89::{MAX_REFRACTIVITY_RATE_MM_H, rain_refractivity_liebe89};
pub use model::{PowerLaw, RainAttenuation, RainModel, rain_attenuation};
pub use table::{RAIN_MODELS, RainModelEntry, rain_model};
