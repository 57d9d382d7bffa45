//! Vegetation over ground: the tau-omega model.

use super::error::{SurfaceError, bounded};

/// A canopy as one layer that absorbs and scatters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Canopy {
    /// Optical depth at nadir, Np.
    pub tau_np: f64,
    /// Single-scattering albedo.
    pub omega: f64,
    /// Physical temperature, K.
    pub temperature_k: f64,
}

/// Weights of the parts of the brightness above a canopy, at one angle and polarisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CanopyBudget {
    /// Weight of the canopy temperature.
    pub canopy: f64,
    /// Factor on the emission of the ground: `g`.
    pub ground: f64,
    /// Weight of the sky mirrored by the ground: `R g^2`.
    pub mirrored_sky: f64,
    /// Weight of the sky that the canopy scatters. The published model omits it. By Kirchhoff's law it equals the emission that the canopy
    /// loses by scattering.
    pub scattered_sky: f64,
}

impl Canopy {
    /// Checked parameters.
    ///
    /// # Errors
    /// [`SurfaceError::Value`] for a negative depth, an albedo outside 0 to 1 or a bad temperature.
    pub fn new(tau_np: f64, omega: f64, temperature_k: f64) -> Result<Self, SurfaceError> {
        Ok(Self {
            tau_np: bounded("optical depth of the canopy", tau_np, 0.0, 1e6)?,
            omega: bounded("albedo of the canopy", omega, 0.0, 1.0)?,
            temperature_k: bounded("temperature of the canopy in K", temperature_k, 1e-3, 1e5)?,
        })
    }

    /// Weights of canopy, ground and sky over a ground of power reflectivity `r`.
    ///
    /// # Reference
    /// Mo et al. 1982, J. Geophys. Res. 87, 11229:
    /// `T = T_v (1-w)(1-g)(1+g R) + (1-R) g T_s + R g^2 T_sky`, `g = exp(-tau sec)`.
    #[must_use]
    pub fn budget(&self, r: f64, cos_theta: f64) -> CanopyBudget {
        let g = (-self.tau_np / cos_theta).exp();
        let absorbed = (1.0 - g) * (1.0 + g * r);
        CanopyBudget { canopy: (1.0 - self.omega) * absorbed, ground: g, mirrored_sky: r * g * g, scattered_sky: self.omega * absorbed }
    }

    /// Brightness of the published formula, K.
    #[must_use]
    pub fn brightness_k(&self, r: f64, cos_theta: f64, ground_k: f64, sky_k: f64) -> f64 {
        let b = self.budget(r, cos_theta);
        b.canopy * self.temperature_k + (1.0 - r) * b.ground * ground_k + b.mirrored_sky * sky_k
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_bare_ground_and_black_canopy() {
        let bare = Canopy::new(0.0, 0.1, 290.0).unwrap();
        assert!((bare.brightness_k(0.3, 0.6, 280.0, 10.0) - (0.7 * 280.0 + 3.0)).abs() < 1e-12);
        let dense = Canopy::new(50.0, 0.06, 290.0).unwrap();
        assert!((dense.brightness_k(0.3, 0.6, 280.0, 10.0) - 0.94 * 290.0).abs() < 1e-9);
    }

    #[test]
    fn shares_add_up_to_one() {
        for (tau, omega, r, cos) in [(0.1, 0.05, 0.4, 0.9), (1.0, 0.12, 0.2, 0.5), (3.0, 0.0, 0.9, 0.2)] {
            let c = Canopy::new(tau, omega, 300.0).unwrap();
            let b = c.budget(r, cos);
            let sum = b.canopy + b.ground * (1.0 - r) + b.mirrored_sky + b.scattered_sky;
            assert!((sum - 1.0).abs() < 1e-14, "{sum}");
        }
    }
}
