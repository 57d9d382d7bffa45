//! Pressure-induced absorption of nitrogen.

/// Imaginary refractivity of nitrogen in ppm, with the dry pressure in hPa.
///
/// # Reference
/// Liebe, Hufford & Cotton 1993, AGARD CP-542:
/// `N'' = 1.40e-12 p_d^2 theta^3.5 f / (1 + 1.93e-5 f^1.5)`.
#[must_use]
pub fn nitrogen_refractivity_ppm(freq_ghz: f64, dry_pressure_hpa: f64, theta: f64) -> f64 {
    let theta_3_5 = theta * theta * theta * theta.sqrt();
    1.40e-12 * dry_pressure_hpa * dry_pressure_hpa * theta_3_5 * freq_ghz / (1.0 + 1.93e-5 * freq_ghz * freq_ghz.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn collision_induced_absorption_is_quadratic_in_pressure() {
        let one = nitrogen_refractivity_ppm(94.0, 500.0, 1.1);
        let two = nitrogen_refractivity_ppm(94.0, 1000.0, 1.1);
        assert!((two / one - 4.0).abs() < 1e-12);
    }
}
