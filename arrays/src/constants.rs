//! Constants of nature and the jansky, in SI units.

/// Speed of light in vacuum, m/s (exact by the definition of the metre).
pub const SPEED_OF_LIGHT_M_S: f64 = 299_792_458.0;
/// Boltzmann constant, J/K (exact by the definition of the kelvin).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;
/// One jansky (Jy), W m^-2 Hz^-1 (exact by definition).
pub const JANSKY_W_M2_HZ: f64 = 1e-26;

/// Flux density in Jy of a uniform brightness temperature of 1 K over 1 sr: 2 k nu^2 / c^2.
///
/// # Reference
/// Rayleigh-Jeans law: Thompson, Moran & Swenson 2017, equation 1.2.
#[must_use]
pub fn jy_per_kelvin_sr(freq_hz: f64) -> f64 {
    2.0 * BOLTZMANN_J_PER_K * (freq_hz / SPEED_OF_LIGHT_M_S).powi(2) / JANSKY_W_M2_HZ
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_kelvin_steradian_at_94_ghz() {
        // 2 * 1.380649e-23 J/K * (94e9 Hz / 299792458 m/s)^2 / 1e-26 W m^-2 Hz^-1
        assert!((jy_per_kelvin_sr(94e9) / 2.714_735_859_69e8 - 1.0).abs() < 1e-11, "{}", jy_per_kelvin_sr(94e9));
    }
}
