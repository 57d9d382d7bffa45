//! Attenuation by rain, a power law `k R^alpha`: one model a file, one row here each.
//!
//! Extinction is used as absorption: an upper bound on what rain emits.

mod itu_p838;
mod olsen78;

use std::sync::Arc;

use super::error::{PhysicsError, check_frequency, check_range};

pub use itu_p838::{ItuP838, PowerLaw};
pub use olsen78::Olsen78;

/// A power law of rain attenuation.
pub trait RainModel: std::fmt::Debug + Send + Sync {
    /// Name in the table, as the command line uses it.
    fn name(&self) -> &'static str;

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

/// A row of the table of rain models.
#[derive(Debug, Clone, Copy)]
pub struct RainModelEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for help texts and the book.
    pub summary: &'static str,
    /// Where it was published.
    pub reference: &'static str,
    /// Reads the coefficients of the model.
    pub build: fn() -> Result<Arc<dyn RainModel>, PhysicsError>,
}

/// Every rain model; the first is the default.
pub const RAIN_MODELS: &[RainModelEntry] = &[
    RainModelEntry {
        name: itu_p838::NAME,
        summary: "ITU-R power law for both polarisations, up to 300 mm/h (default)",
        reference: "Recommendation ITU-R P.838-3 (2005)",
        build: || Ok(Arc::new(ItuP838::new()?)),
    },
    RainModelEntry {
        name: olsen78::NAME,
        summary: "period power law of frequency bands, up to 25 mm/h",
        reference: "Olsen, Rogers & Hodge 1978, IEEE Trans. AP 26, 318",
        build: || Ok(Arc::new(Olsen78)),
    },
];

/// Finds a rain model by name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn rain_model(name: &str) -> Result<Arc<dyn RainModel>, PhysicsError> {
    match RAIN_MODELS.iter().find(|entry| entry.name == name) {
        Some(entry) => (entry.build)(),
        None => Err(PhysicsError::UnknownName {
            kind: "rain model",
            name: name.to_owned(),
            known: RAIN_MODELS.iter().map(|e| e.name).collect::<Vec<_>>().join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_builds_under_its_name() {
        for entry in RAIN_MODELS {
            assert_eq!(rain_model(entry.name).unwrap().name(), entry.name);
        }
        assert!(rain_model("p837").unwrap_err().to_string().contains("p838, olsen78"));
    }

    #[test]
    fn no_rain_is_no_attenuation_and_negative_rain_an_error() {
        for entry in RAIN_MODELS {
            let model = (entry.build)().unwrap();
            let none = rain_attenuation(model.as_ref(), 35.0, 0.0).unwrap();
            assert_eq!(none.mean_db_per_km(), 0.0);
            let message = rain_attenuation(model.as_ref(), 35.0, -1.0).unwrap_err().to_string();
            assert!(message.starts_with("rain rate -1 mm/h is outside"), "{message}");
        }
    }
}
