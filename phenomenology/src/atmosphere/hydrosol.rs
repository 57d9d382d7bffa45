//! Absorption and refraction by suspended droplets and ice crystals much smaller than the wavelength.
//!
//! Haze, fog and cloud differ only in the amount of water. Scattering is not included. The Rayleigh approximation is valid for radii below
//! about 50 um.

use num_complex::Complex64;

use super::error::{MAX_FREQ_GHZ, PhysicsError, check_frequency, check_range};

/// Lowest temperature of liquid droplets, K. Colder droplets freeze spontaneously.
pub const MIN_DROPLET_K: f64 = 233.0;
/// Highest temperature of liquid droplets, K.
pub const MAX_DROPLET_K: f64 = 333.0;
/// Lowest temperature of ice crystals, K.
pub const MIN_ICE_K: f64 = 150.0;
/// Highest temperature of ice crystals, K.
pub const MAX_ICE_K: f64 = 273.16;
/// Highest density of suspended water, g/m3.
pub const MAX_DENSITY_G_M3: f64 = 10.0;

/// Permittivity `eps' - j eps''` of liquid water as used for droplets.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993, AGARD CP-542 (double Debye).
#[must_use]
pub fn droplet_permittivity_liebe93(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let excess = 300.0 / temperature_k - 1.0;
    let e0 = 77.66 + 103.3 * excess;
    let e1 = 0.0671 * e0;
    let e2 = 3.52;
    let g1 = 20.20 - 146.4 * excess + 316.0 * excess * excess;
    let g2 = 39.8 * g1;
    e0 - freq_ghz * ((e0 - e1) / Complex64::new(freq_ghz, -g1) + (e1 - e2) / Complex64::new(freq_ghz, -g2))
}

/// Permittivity `eps' - j eps''` of ice as used for crystals.
///
/// # Reference
/// Hufford 1991, Int. J. IR & MM Waves 12, 677, as in Liebe, Hufford & Cotton 1993.
#[must_use]
pub fn crystal_permittivity_liebe93(freq_ghz: f64, temperature_k: f64) -> Complex64 {
    let theta = 300.0 / temperature_k;
    let a = (62.0 * theta - 11.6) * 1e-4 * (-22.1 * (theta - 1.0)).exp();
    let b = 0.542e-6 * (-24.17 + 116.79 / theta + (theta / (theta - 0.9927)).powi(2));
    Complex64::new(3.15, -(a / freq_ghz + b * freq_ghz))
}

/// Specific attenuation in dB/km of `density_g_m3` of liquid droplets.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 1-1000 GHz, 233-333 K or 0-10 g/m3.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993: `0.1820 f 1.5 w Im[(eps-1)/(eps+2)]`.
pub fn droplet_attenuation_liebe93(freq_ghz: f64, temperature_k: f64, density_g_m3: f64) -> Result<f64, PhysicsError> {
    check_frequency(freq_ghz)?;
    check_range("liquid water density", density_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
    check_range("temperature of liquid droplets", temperature_k, "K", MIN_DROPLET_K, MAX_DROPLET_K)?;
    let eps = droplet_permittivity_liebe93(freq_ghz, temperature_k);
    Ok(rayleigh_attenuation_db_per_km(freq_ghz, eps, density_g_m3, 1.0))
}

/// Specific attenuation in dB/km of `density_g_m3` of ice crystals.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 1-1000 GHz, 150-273.16 K or 0-10 g/m3.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993, with ice of 0.916 g/cm3.
pub fn crystal_attenuation_liebe93(freq_ghz: f64, temperature_k: f64, density_g_m3: f64) -> Result<f64, PhysicsError> {
    check_frequency(freq_ghz)?;
    check_range("ice density", density_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
    check_range("temperature of ice crystals", temperature_k, "K", MIN_ICE_K, MAX_ICE_K)?;
    let eps = crystal_permittivity_liebe93(freq_ghz, temperature_k);
    Ok(rayleigh_attenuation_db_per_km(freq_ghz, eps, density_g_m3, 0.916))
}

/// Complex refractivity `N' - j N''` in ppm of `density_g_m3` of liquid droplets.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 0-1000 GHz, 233-333 K or 0-10 g/m3.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993: `1.5 w (eps-1)/(eps+2)`.
pub fn droplet_refractivity_liebe93(freq_ghz: f64, temperature_k: f64, density_g_m3: f64) -> Result<Complex64, PhysicsError> {
    check_range("frequency", freq_ghz, "GHz", 0.0, MAX_FREQ_GHZ)?;
    check_range("liquid water density", density_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
    check_range("temperature of liquid droplets", temperature_k, "K", MIN_DROPLET_K, MAX_DROPLET_K)?;
    let eps = droplet_permittivity_liebe93(freq_ghz, temperature_k);
    Ok(1.5 * density_g_m3 * (eps - 1.0) / (eps + 2.0))
}

/// Real refractivity in ppm of `density_g_m3` of ice crystals. The loss of ice changes it by less than one part in 1e4.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 150-273.16 K or 0-10 g/m3.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993: `1.5 (w/0.916) (eps-1)/(eps+2)`, `eps = 3.15`.
pub fn crystal_refractivity_liebe93(temperature_k: f64, density_g_m3: f64) -> Result<f64, PhysicsError> {
    check_range("ice density", density_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
    check_range("temperature of ice crystals", temperature_k, "K", MIN_ICE_K, MAX_ICE_K)?;
    Ok(1.5 * (density_g_m3 / 0.916) * 2.15 / 5.15)
}

fn rayleigh_attenuation_db_per_km(freq_ghz: f64, eps: Complex64, density_g_m3: f64, bulk_density: f64) -> f64 {
    let loss = -eps.im;
    let imaginary = 3.0 * loss / ((eps.re + 2.0).powi(2) + loss * loss);
    0.1820 * freq_ghz * 1.5 * (density_g_m3 / bulk_density) * imaginary
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn static_permittivity_is_the_debye_limit() {
        let eps = droplet_permittivity_liebe93(1e-6, 300.0);
        assert!((eps.re - 77.66).abs() < 1e-6 && eps.im.abs() < 1e-4);
    }

    #[test]
    fn attenuation_is_linear_in_density() {
        let one = droplet_attenuation_liebe93(94.0, 280.0, 0.1).unwrap();
        let three = droplet_attenuation_liebe93(94.0, 280.0, 0.3).unwrap();
        assert!((three / one - 3.0).abs() < 1e-12);
    }

    #[test]
    fn loss_and_attenuation_of_droplets_are_one_number() {
        for freq in [1.0, 94.0, 900.0] {
            let n = droplet_refractivity_liebe93(freq, 275.0, 0.3).unwrap();
            let db = droplet_attenuation_liebe93(freq, 275.0, 0.3).unwrap();
            assert!((0.1820 * freq * -n.im / db - 1.0).abs() < 1e-12);
        }
        // A metal would have 1.5 ppm for each g/m3; static water has almost that.
        let still = droplet_refractivity_liebe93(0.0, 288.0, 1.0).unwrap();
        assert!((1.4..1.5).contains(&still.re) && still.im == 0.0);
        let ice = crystal_refractivity_liebe93(260.0, 1.0).unwrap();
        let eps = crystal_permittivity_liebe93(94.0, 260.0);
        assert!((ice / (1.5 / 0.916 * (eps - 1.0) / (eps + 2.0)).re - 1.0).abs() < 1e-4);
    }

    #[test]
    fn ice_absorbs_far_less_than_water() {
        let ice = crystal_attenuation_liebe93(94.0, 265.0, 0.1).unwrap();
        let water = droplet_attenuation_liebe93(94.0, 265.0, 0.1).unwrap();
        assert!(ice < 0.02 * water);
    }

    #[test]
    fn ranges_are_errors() {
        assert!(droplet_attenuation_liebe93(94.0, 200.0, 0.1).is_err());
        assert!(droplet_attenuation_liebe93(94.0, 280.0, -0.1).is_err());
        assert!(droplet_attenuation_liebe93(1001.0, 280.0, 0.1).is_err());
        assert!(crystal_attenuation_liebe93(94.0, 280.0, 0.1).is_err());
    }
}
