//! Physical constants the dielectric and surface models share.

/// Speed of light in vacuum, m/s.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// Permittivity of vacuum, F/m.
pub const VACUUM_PERMITTIVITY_F_M: f64 = 8.854_187_8e-12;
/// Zero Celsius in kelvin.
pub const ZERO_CELSIUS_K: f64 = 273.15;
/// Density of pure ice that the snow models divide by, kg/m3.
pub const ICE_DENSITY_KG_M3: f64 = 916.7;
