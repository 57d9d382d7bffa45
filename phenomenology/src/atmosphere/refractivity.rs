//! Radio refractivity of air, which refracts rays near the horizon.

use super::air::AirState;

/// Refractivity `N = 1e6 (n - 1)` of air.
///
/// # Reference
/// Thayer 1974, Radio Science 9, 803, without compressibility:
/// `N = 77.604 p_d/T + 64.79 e/T + 3.776e5 e/T^2` (hPa, K).
#[must_use]
pub fn refractivity_thayer74(air: &AirState) -> f64 {
    let t = air.temperature_k();
    let e = air.vapour_pressure_hpa();
    77.604 * air.dry_pressure_hpa() / t + 64.79 * e / t + 3.776e5 * e / (t * t)
}

/// Refractive index `n = 1 + 1e-6 N` of air.
#[must_use]
pub fn refractive_index(air: &AirState) -> f64 {
    1.0 + 1e-6 * refractivity_thayer74(air)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refractivity_of_standard_surface_air() {
        let dry = AirState::new(1013.25, 288.15, 0.0).unwrap();
        assert!((refractivity_thayer74(&dry) - 77.604 * 1013.25 / 288.15).abs() < 1e-9);
        let moist = AirState::new(1013.25, 288.15, 10.0).unwrap();
        let gain = refractivity_thayer74(&moist) - refractivity_thayer74(&dry);
        assert!((gain - 10.0 / 288.15 * (64.79 - 77.604 + 3.776e5 / 288.15)).abs() < 1e-9);
    }
}
