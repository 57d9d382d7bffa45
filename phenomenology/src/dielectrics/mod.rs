//! The dielectric data base: permittivity of natural and built materials.
//!
//! Permittivities are `eps' - j eps''` with positive loss, for the time factor `exp(+j w t)`.
//! A [`Material`] has parameters with defaults and one or more models. A [`Model`] is one published formula with its range. Each file holds
//! one model. To add a model, write its file, add its row to [`MODELS`], and name it in a row of the material table.
//!
//! ```
//! use cittert_phenomenology::dielectrics::Material;
//! let sea = Material::by_name("sea-water")?;
//! let eps = sea.permittivity(&sea.state(), 10e9)?;
//! assert!(eps.re > 40.0 && eps.im < -30.0);
//! # Ok::<(), cittert_phenomenology::dielectrics::DielectricError>(())
//! ```

mod brine_volume;
mod conductor;
mod constant;
mod csv_table;
mod dobson85;
mod error;
mod evaluate;
mod fresh_ice;
mod hallikainen86;
mod hufford91;
mod klein_swift77;
mod liebe91;
mod maetzler06;
mod maetzler96;
mod material;
mod meissner_wentz04;
mod mironov09;
pub mod mixing;
mod model;
#[cfg(test)]
mod oracle_tests;
mod p2040;
mod polder_van_santen46;
mod registry;
mod rows;
mod sea_ice;
mod soil_texture;
mod soil_water;
mod spec;
mod state;
mod stogryn95;
mod stogryn_desargant85;
mod table;
mod turner16;
mod ulaby86;
mod ulaby_el_rayes87;

pub use brine_volume::brine_volume_cox_weeks83;
pub use conductor::conductor_permittivity;
pub use dobson85::soil_permittivity_dobson85;
pub use error::DielectricError;
pub use evaluate::{Permittivity, material_of_model};
pub use hallikainen86::wet_snow_permittivity_hallikainen86;
pub use hufford91::ice_permittivity_hufford91;
pub use klein_swift77::sea_water_permittivity_klein_swift77;
pub use liebe91::water_permittivity_liebe91;
pub use maetzler06::ice_permittivity_maetzler06;
pub use maetzler96::{dry_snow_permittivity_maetzler96, grain_factors_maetzler96};
pub use material::Material;
pub use meissner_wentz04::sea_water_permittivity_meissner_wentz04;
pub use mironov09::soil_permittivity_mironov09;
pub use model::{Band, Bands, Extrapolation, Formula, Model, Query, Range, permittivity_of};
pub use p2040::{BuildingRow, building_permittivity_p2040, building_table};
pub use polder_van_santen46::wet_snow_permittivity_polder_van_santen46;
pub use registry::{MODELS, model_by_name};
pub use rows::{PermittivityRow, permittivity_rows};
pub use sea_ice::{BrinePockets, sea_ice_permittivity};
pub use soil_texture::SoilTexture;
pub use soil_water::SOIL_PARTICLE_DENSITY_KG_M3;
pub use spec::{Constants, ParameterSpec, Pores};
pub use state::{MaterialState, Parameter};
pub use stogryn_desargant85::brine_permittivity_stogryn_desargant85;
pub use stogryn95::{sea_water_conductivity_stogryn95, sea_water_permittivity_stogryn95};
pub use turner16::water_permittivity_turner16;
pub use ulaby_el_rayes87::leaf_permittivity_ulaby_el_rayes87;
pub use ulaby86::{soil_permittivity_ulaby86, soil_water_ulaby86};
