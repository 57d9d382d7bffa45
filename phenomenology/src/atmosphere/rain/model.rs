//! The interface of a rain model, and the attenuation it gives.

use crate::atmosphere::error::{PhysicsError, check_frequency, check_range};

/// `gamma = k R^alpha`, gamma in dB/km and R in mm/h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// Factor.
    pub k: f64,
    /// Exponent.
    pub alpha: f64,
}

impl PowerLaw {
    /// Specific attenuation in dB/km at a rain rate in mm/h.
    #[must_use]
    pub fn attenuation_db_per_km(&self, rate_mm_h: f64) -> f64 {
        self.k * rate_mm_h.powf(self.alpha)
    }
}

/// A power law of rain attenuation.
pub trait RainModel: std::fmt::Debug + Send + Sync {
    /// Largest rain rate the model covers, mm/h.
    fn max_rate_mm_h(&self) -> f64;

    /// Coefficients for horizontal and vertical polarisation on a horizontal path.
    fn power_laws(&self, freq_ghz: f64) -> [PowerLaw; 2];
}

/// Specific attenuation by rain on a horizontal path, dB/km.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RainAttenuation {
    /// Horizontal polarisation.
    pub horizontal_db_per_km: f64,
    /// Vertical polarisation.
    pub vertical_db_per_km: f64,
}

impl RainAttenuation {
    /// Mean of both polarisations, which the radiative transfer uses.
    #[must_use]
    pub fn mean_db_per_km(&self) -> f64 {
        0.5 * (self.horizontal_db_per_km + self.vertical_db_per_km)
    }
}

/// Specific attenuation of rain at `rate_mm_h`.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] outside 1-1000 GHz or the rain rates of the model.
pub fn rain_attenuation(model: &dyn RainModel, freq_ghz: f64, rate_mm_h: f64) -> Result<RainAttenuation, PhysicsError> {
    check_frequency(freq_ghz)?;
    check_range("rain rate", rate_mm_h, "mm/h", 0.0, model.max_rate_mm_h())?;
    let [horizontal, vertical] = model.power_laws(freq_ghz);
    Ok(RainAttenuation {
        horizontal_db_per_km: horizontal.attenuation_db_per_km(rate_mm_h),
        vertical_db_per_km: vertical.attenuation_db_per_km(rate_mm_h),
    })
}
