//! The state of a parcel of air: pressure, temperature and water vapour.

use super::error::{PhysicsError, check_range};

/// Lowest total pressure of the absorption models, hPa. At higher pressures Zeeman splitting and Doppler broadening are negligible.
pub const MIN_PRESSURE_HPA: f64 = 3.0;
/// Highest total pressure accepted, hPa.
pub const MAX_PRESSURE_HPA: f64 = 1200.0;
/// Lowest air temperature accepted, K.
pub const MIN_TEMPERATURE_K: f64 = 150.0;
/// Highest air temperature accepted, K.
pub const MAX_TEMPERATURE_K: f64 = 350.0;

/// A valid state of air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirState {
    pressure_hpa: f64,
    temperature_k: f64,
    vapour_pressure_hpa: f64,
}

/// Amount of water vapour in the air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Humidity {
    /// Relative humidity over liquid water, percent (0-100).
    RelativePercent(f64),
    /// Vapour density, g/m3.
    VapourDensity(f64),
    /// Partial pressure of vapour, hPa.
    VapourPressure(f64),
}

impl AirState {
    /// Builds a state from total pressure (hPa), temperature (K) and vapour pressure (hPa).
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside 3-1200 hPa or 150-350 K, or for a negative
    /// vapour pressure; [`PhysicsError::Refused`] when vapour exceeds the total.
    pub fn new(pressure_hpa: f64, temperature_k: f64, vapour_pressure_hpa: f64) -> Result<Self, PhysicsError> {
        check_range("pressure", pressure_hpa, "hPa", MIN_PRESSURE_HPA, MAX_PRESSURE_HPA)?;
        check_range("temperature", temperature_k, "K", MIN_TEMPERATURE_K, MAX_TEMPERATURE_K)?;
        if !(0.0..=pressure_hpa).contains(&vapour_pressure_hpa) {
            let range = format!("0 to {pressure_hpa} hPa (the total pressure)");
            let message = format!("vapour pressure {vapour_pressure_hpa} hPa is outside the valid range {range}");
            return Err(PhysicsError::Refused(message));
        }
        Ok(Self { pressure_hpa, temperature_k, vapour_pressure_hpa })
    }

    /// Builds a state from any measure of humidity.
    ///
    /// # Errors
    /// As [`AirState::new`]; also [`PhysicsError::OutOfRange`] for a negative humidity
    /// or a relative humidity above 100 %.
    pub fn with_humidity(pressure_hpa: f64, temperature_k: f64, humidity: Humidity) -> Result<Self, PhysicsError> {
        // Check pressure and temperature before they enter a humidity conversion.
        Self::new(pressure_hpa, temperature_k, 0.0)?;
        Self::new(pressure_hpa, temperature_k, humidity.vapour_pressure_hpa(temperature_k)?)
    }

    /// Total pressure, hPa.
    #[must_use]
    pub fn pressure_hpa(&self) -> f64 {
        self.pressure_hpa
    }

    /// Temperature, K.
    #[must_use]
    pub fn temperature_k(&self) -> f64 {
        self.temperature_k
    }

    /// Partial pressure of water vapour, hPa.
    #[must_use]
    pub fn vapour_pressure_hpa(&self) -> f64 {
        self.vapour_pressure_hpa
    }

    /// Pressure of the dry air, hPa.
    #[must_use]
    pub fn dry_pressure_hpa(&self) -> f64 {
        self.pressure_hpa - self.vapour_pressure_hpa
    }

    /// Vapour density, g/m3.
    #[must_use]
    pub fn vapour_density_g_m3(&self) -> f64 {
        vapour_density_g_m3(self.vapour_pressure_hpa, self.temperature_k)
    }

    /// Relative humidity over liquid water, percent.
    #[must_use]
    pub fn relative_humidity_percent(&self) -> f64 {
        100.0 * self.vapour_pressure_hpa / saturation_pressure_hpa_goff46(self.temperature_k)
    }

    /// Inverse temperature `theta = 300 K / T`.
    #[must_use]
    pub fn theta(&self) -> f64 {
        300.0 / self.temperature_k
    }
}

impl Humidity {
    /// Vapour pressure in hPa at a temperature in K.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a negative or non-finite humidity, or a
    /// relative humidity above 100 %.
    pub fn vapour_pressure_hpa(self, temperature_k: f64) -> Result<f64, PhysicsError> {
        match self {
            Self::RelativePercent(rh) => {
                check_range("relative humidity", rh, "%", 0.0, 100.0)?;
                Ok(rh / 100.0 * saturation_pressure_hpa_goff46(temperature_k))
            }
            Self::VapourDensity(rho) => {
                check_range("vapour density", rho, "g/m3", 0.0, 500.0)?;
                Ok(rho * temperature_k / VAPOUR_CONSTANT)
            }
            Self::VapourPressure(e) => check_range("vapour pressure", e, "hPa", 0.0, MAX_PRESSURE_HPA),
        }
    }
}

/// Ideal-gas constant of water vapour, g K / (m3 hPa).
const VAPOUR_CONSTANT: f64 = 216.68;

/// Vapour density in g/m3 of a vapour pressure in hPa at a temperature in K.
#[must_use]
pub fn vapour_density_g_m3(vapour_pressure_hpa: f64, temperature_k: f64) -> f64 {
    VAPOUR_CONSTANT * vapour_pressure_hpa / temperature_k
}

/// Saturation vapour pressure over liquid water in hPa at a temperature in K.
///
/// # Reference
/// Goff & Gratch 1946, Trans. ASHVE 52, 95.
#[must_use]
pub fn saturation_pressure_hpa_goff46(temperature_k: f64) -> f64 {
    let y = 373.16 / temperature_k;
    let log10_e = -7.90298 * (y - 1.0) + 5.02808 * y.log10() - 1.3816e-7 * (10f64.powf(11.344 * (1.0 - 1.0 / y)) - 1.0)
        + 8.1328e-3 * (10f64.powf(-3.49149 * (y - 1.0)) - 1.0)
        + 1013.246f64.log10();
    10f64.powf(log10_e)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn water_boils_at_one_atmosphere() {
        assert!((saturation_pressure_hpa_goff46(373.16) - 1013.246).abs() < 1e-6);
        assert!((saturation_pressure_hpa_goff46(273.16) - 6.1).abs() < 0.02);
    }

    #[test]
    fn humidities_agree_with_each_other() {
        let by_density = AirState::with_humidity(1013.0, 290.0, Humidity::VapourDensity(7.5)).unwrap();
        let rh = by_density.relative_humidity_percent();
        let by_rh = AirState::with_humidity(1013.0, 290.0, Humidity::RelativePercent(rh)).unwrap();
        assert!((by_rh.vapour_pressure_hpa() - by_density.vapour_pressure_hpa()).abs() < 1e-12);
        assert!((by_density.vapour_density_g_m3() - 7.5).abs() < 1e-12);
    }

    #[test]
    fn bad_states_name_value_and_range() {
        let cases = [
            (AirState::new(1013.0, 0.0, 5.0), "temperature 0 K is outside"),
            (AirState::new(-1.0, 290.0, 0.0), "pressure -1 hPa is outside"),
            (AirState::new(1013.0, 290.0, -2.0), "vapour pressure -2 hPa is outside"),
            (AirState::new(500.0, 290.0, 501.0), "0 to 500 hPa"),
            (AirState::new(f64::NAN, 290.0, 1.0), "pressure NaN hPa is outside"),
            (AirState::with_humidity(1013.0, 290.0, Humidity::RelativePercent(-3.0)), "relative humidity -3 %"),
            (AirState::with_humidity(1013.0, 290.0, Humidity::VapourDensity(-7.5)), "vapour density -7.5 g/m3"),
            (AirState::with_humidity(1013.0, 0.0, Humidity::RelativePercent(50.0)), "temperature 0 K is outside"),
        ];
        for (result, text) in cases {
            let message = result.unwrap_err().to_string();
            assert!(message.contains(text), "{message}");
        }
    }
}
