//! Refractivity of rain.

use crate::atmosphere::error::{MAX_FREQ_GHZ, PhysicsError, check_range};

/// Highest rain rate of the refractivity, mm/h.
pub const MAX_REFRACTIVITY_RATE_MM_H: f64 = 150.0;

/// Real refractivity of rain in ppm. Above some 50 GHz drops are large against the wavelength and delay no more.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 0-1000 GHz or 0-150 mm/h.
///
/// # Reference
/// Liebe 1989, Int. J. IR & MM Waves 10, 631: `N' = N0/(1 + x^2.5)`, `N0 = R (3.68 - 0.012 R)/f_R`, `x = f/f_R`,
/// `f_R = 53 - R (0.37 - 0.0015 R)` GHz.
pub fn rain_refractivity_liebe89(freq_ghz: f64, rate_mm_h: f64) -> Result<f64, PhysicsError> {
    check_range("frequency", freq_ghz, "GHz", 0.0, MAX_FREQ_GHZ)?;
    let rate = check_range("rain rate of a delay", rate_mm_h, "mm/h", 0.0, MAX_REFRACTIVITY_RATE_MM_H)?;
    let corner_ghz = 53.0 - rate * (0.37 - 0.0015 * rate);
    let still = rate * (3.68 - 0.012 * rate) / corner_ghz;
    Ok(still / (1.0 + (freq_ghz / corner_ghz).powf(2.5)))
}

#[cfg(test)]
mod tests {
    use super::*;

    // At low frequency drops are Rayleigh scatterers: 1.5 ppm for each g/m3. Marshall & Palmer 1948 have 0.072 R^0.88 g/m3 in rain.
    #[test]
    fn still_rain_is_its_water() {
        for rate in [1.0, 5.0, 25.0, 100.0, 150.0] {
            let water = 0.072 * f64::powf(rate, 0.88);
            let ratio = rain_refractivity_liebe89(0.0, rate).unwrap() / (1.45 * water);
            println!("{rate} mm/h: {ratio:.3} of Marshall and Palmer");
            assert!((0.6..1.6).contains(&ratio), "{rate}: {ratio}");
        }
        assert_eq!(rain_refractivity_liebe89(94.0, 0.0).unwrap(), 0.0);
        assert!(rain_refractivity_liebe89(94.0, 25.0).unwrap() < 0.15 * rain_refractivity_liebe89(0.0, 25.0).unwrap());
        assert!(rain_refractivity_liebe89(94.0, 151.0).is_err() && rain_refractivity_liebe89(-1.0, 1.0).is_err());
    }
}
