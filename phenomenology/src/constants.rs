//! Physical constants of the 2019 SI, shared by every physics module.

/// Speed of light in vacuum, m/s.
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// Planck constant, J s.
pub const PLANCK_J_S: f64 = 6.626_070_15e-34;
/// Boltzmann constant, J/K.
pub const BOLTZMANN_J_K: f64 = 1.380_649e-23;
/// Vacuum permittivity, F/m.
pub const VACUUM_PERMITTIVITY_F_M: f64 = 8.854_187_8e-12;
