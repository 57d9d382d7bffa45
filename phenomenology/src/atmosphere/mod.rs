//! The radiometric atmosphere: absorption, profiles and radiative transfer, 1-1000 GHz.
//!
//! - [`gas`]: oxygen, water vapour and nitrogen, one model a file ([`GAS_MODELS`]).
//! - [`hydrosol`]: suspended droplets and ice; [`rain`]: power laws ([`RAIN_MODELS`]).
//! - [`Profile`], [`ATMOSPHERES`], [`Layer`]: the air and what lies on it.
//! - [`Atmosphere::sky`], [`Atmosphere::path`]: the full integrals.
//! - [`Atmosphere::delay`], [`Atmosphere::path_delay`]: excess path length and phase, from 0 GHz.
//! - [`SkyTable`], [`PathTable`]: tables for ray tracing.
//! - [`Hydrometeors`], [`Mixture`]: the water of a cloud, and its radiation in the air around it.
//!
//! Units are those of the papers: GHz, hPa, K, km, g/m3, mm/h; angles in degrees from the
//! zenith. Radiance is the photon occupation number (see [`planck`]).
//!
//! ```
//! use cittert_phenomenology::atmosphere::{Atmosphere, Geometry};
//!
//! let air = Atmosphere::reference("ussa", "mpm89")?;
//! let sky = air.sky(&[94.0], &[0.0, 60.0], Geometry::Plane)?;
//! assert!((sky[0].tb_planck_k - 45.4).abs() < 0.1);
//! # Ok::<(), cittert_phenomenology::atmosphere::PhysicsError>(())
//! ```

mod adaptive;
mod air;
mod air_grid;
mod attenuation;
mod csv_table;
mod delay;
mod delay_field;
mod error;
pub mod gas;
mod grid;
mod hydrometeors;
pub mod hydrosol;
mod layer;
mod mixture;
mod model;
mod path;
mod path_table;
pub mod planck;
mod profile;
mod profile_csv;
pub mod rain;
mod ray;
mod reference;
mod refractivity;
mod sky;
mod sky_table;
mod surface_scaling;
#[cfg(test)]
mod tests;
mod transfer;

pub use air::{
    AirState, Humidity, MAX_PRESSURE_HPA, MAX_TEMPERATURE_K, MIN_PRESSURE_HPA, MIN_TEMPERATURE_K, saturation_pressure_hpa_goff46,
    vapour_density_g_m3,
};
pub use attenuation::{AttenuationRow, Parcel, attenuation};
pub use delay::{DelayRow, PathDelay};
pub use delay_field::DelayField;
pub use error::{MAX_FREQ_GHZ, MIN_FREQ_GHZ, PhysicsError, check_frequency, check_range};
pub use gas::{GAS_MODELS, GasModel, GasModelEntry, NEPER_PER_DECIBEL, gas_model};
pub use hydrometeors::Hydrometeors;
pub use hydrosol::{crystal_attenuation_liebe93, crystal_refractivity_liebe93, droplet_attenuation_liebe93, droplet_refractivity_liebe93};
pub use layer::{LAYER_KINDS, Layer, LayerKind, LayerKindEntry, Phase, check_layers};
pub use mixture::Mixture;
pub use model::Atmosphere;
pub use path::{PathEnds, PathExtent};
pub use path_table::PathTable;
pub use profile::{Level, Profile, TOP_OF_ATMOSPHERE_KM};
pub use rain::{ItuP838, PowerLaw, RAIN_MODELS, RainAttenuation, RainModel, RainModelEntry, rain_attenuation, rain_model};
pub use ray::EARTH_RADIUS_KM;
pub use reference::{ATMOSPHERES, ReferenceAtmosphere, reference_profile};
pub use refractivity::{refractive_index, refractivity_thayer74};
pub use sky::{GEOMETRIES, Geometry, SkyRow};
pub use sky_table::{SkyTable, SkyTableOptions};
pub use surface_scaling::SurfaceWeather;
pub use transfer::PathRadiation;
