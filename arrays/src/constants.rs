//! Constants of nature and the jansky, in SI units.

/// Speed of light in vacuum, m/s (exact by the definition of the metre).
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// Boltzmann constant, J/K (exact by the definition of the kelvin).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;
/// One jansky (Jy), W m^-2 Hz^-1 (exact by definition).
pub const JANSKY_W_M2_HZ: f64 = 1e-26;
