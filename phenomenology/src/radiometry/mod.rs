//! Tables for the tracer: reflection and emission of surfaces, and the temperature of the sky.
//!
//! Radiances are Rayleigh-Jeans temperatures `x B(T)` in K, which add up. Only the finished picture is converted to Planck temperature.

mod angle_table;
mod diffuse_table;
mod facet_table;
mod options;
mod response;
mod sky_lookup;
mod surface_table;

pub use angle_table::AngleTable;
pub use diffuse_table::DiffuseTable;
pub use facet_table::FacetTable;
pub use options::TableOptions;
pub use response::Response;
pub use sky_lookup::SkyLookup;
pub use surface_table::{Scattered, SurfaceTable};
