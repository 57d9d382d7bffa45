//! Physical constants, of the 2019 SI where it defines them, shared by every physics module.

pub use cittert_arrays::{BOLTZMANN_J_PER_K, SPEED_OF_LIGHT_M_S};

/// Planck constant, J s.
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;
/// Vacuum permittivity, F/m.
pub const VACUUM_PERMITTIVITY_F_M: f64 = 8.854_187_8e-12;
/// Zero Celsius in kelvin.
pub const ZERO_CELSIUS_K: f64 = 273.15;
/// Density of pure ice that the snow models divide by, kg/m3.
pub const ICE_DENSITY_KG_M3: f64 = 916.7;
