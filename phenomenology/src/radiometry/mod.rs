//! Tables for the tracer: what surfaces, sky and air do, ready to be looked up.
//!
//! Radiances are Rayleigh-Jeans temperatures `x B(T)` in K, which add up; only the finished picture is read as Planck temperature.

mod angle_table;
mod sky_lookup;
mod surface_table;

pub use angle_table::AngleTable;
pub use sky_lookup::SkyLookup;
pub use surface_table::{Response, RoughSky, SurfaceTable};
