//! The dielectric data base: permittivity of natural and built materials.
//!
//! Permittivities are `eps' - j eps''` with positive loss, for the time factor `exp(+j w t)`.
//! A [`Material`] has parameters with defaults and one or more models. A [`Model`] is one published formula with its range. Each file holds
//! the formulas for one kind of matter; the table `tables/materials/materials.toml` holds the rest. To add a model, write its function into
//! the file of its matter, name it in `formulas.rs`, and add its row to the table.
//!
//! ```
//! use cittert_phenomenology::dielectrics::Material;
//! let sea = Material::by_name("sea-water")?;
//! let eps = sea.permittivity(&sea.state(), 10e9)?;
//! assert!(eps.re > 40.0 && eps.im < -30.0);
//! # Ok::<(), cittert_phenomenology::dielectrics::DielectricError>(())
//! ```

mod csv_table;
mod error;
mod evaluate;
mod formulas;
mod ice;
mod leaf;
mod material;
pub mod mixing;
mod model;
#[cfg(test)]
mod oracle_tests;
mod p2040;
mod snow;
mod soil;
mod soil_texture;
mod state;
mod tables;
mod water;

pub use error::DielectricError;
pub use evaluate::{Permittivity, material_of_model};
pub use formulas::conductor_permittivity;
pub use ice::{
    BrinePockets, brine_permittivity_stogryn_desargant85, brine_volume_cox_weeks83, ice_permittivity_hufford91,
    ice_permittivity_maetzler06, sea_ice_permittivity,
};
pub use leaf::leaf_permittivity_ulaby_el_rayes87;
pub use material::{Constants, Material};
pub use model::{Band, Extrapolation, Model, permittivity_of};
pub use p2040::{BuildingRow, building_permittivity_p2040, building_table};
pub use snow::{
    dry_snow_permittivity_maetzler96, grain_factors_maetzler96, wet_snow_permittivity_hallikainen86,
    wet_snow_permittivity_polder_van_santen46,
};
pub use soil::{
    SOIL_PARTICLE_DENSITY_KG_M3, soil_permittivity_dobson85, soil_permittivity_mironov09, soil_permittivity_ulaby86, soil_water_ulaby86,
};
pub use soil_texture::SoilTexture;
pub use state::{MaterialState, Parameter, ParameterSpec, Range};
pub use water::{
    sea_water_conductivity_stogryn95, sea_water_permittivity_klein_swift77, sea_water_permittivity_meissner_wentz04,
    sea_water_permittivity_stogryn95, water_permittivity_liebe91, water_permittivity_turner16,
};
