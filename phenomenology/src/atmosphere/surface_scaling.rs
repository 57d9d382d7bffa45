//! Scales a profile to weather measured at the surface.

use super::air::{AirState, Humidity, saturation_pressure_hpa_goff46};
use super::error::PhysicsError;
use super::profile::{Level, Profile};

/// Height above the surface at which a change of the surface temperature has no effect, km.
const TEMPERATURE_TAPER_KM: f64 = 10.0;

/// Weather measured at the surface. A value that is absent stays that of the profile.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SurfaceWeather {
    /// Total pressure, hPa: the whole pressure profile is multiplied to meet it.
    pub pressure_hpa: Option<f64>,
    /// Temperature, K: the difference is added, falling linearly to zero 10 km up.
    pub temperature_k: Option<f64>,
    /// Humidity: the relative humidity of every level is multiplied to meet it.
    pub humidity: Option<Humidity>,
}

impl Profile {
    /// The profile scaled to weather measured at the surface.
    ///
    /// If only the temperature changes, the relative humidity stays the same. It never exceeds 100 % (or its old value, if that was higher).
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for values outside those of [`AirState`].
    pub fn with_surface_weather(&self, weather: &SurfaceWeather) -> Result<Self, PhysicsError> {
        let old = self.surface();
        let pressure = weather.pressure_hpa.unwrap_or_else(|| old.pressure_hpa());
        let temperature = weather.temperature_k.unwrap_or_else(|| old.temperature_k());
        let new_surface = match weather.humidity {
            Some(humidity) => AirState::with_humidity(pressure, temperature, humidity)?,
            None => {
                AirState::new(pressure, temperature, 0.0)?;
                let kept = old.relative_humidity_percent() / 100.0 * saturation_pressure_hpa_goff46(temperature);
                AirState::new(pressure, temperature, kept)?
            }
        };
        let pressure_ratio = pressure / old.pressure_hpa();
        let warming = temperature - old.temperature_k();
        let surface_rh = new_surface.relative_humidity_percent();
        let old_surface_rh = old.relative_humidity_percent();
        let bottom = self.bottom_km();

        let levels = self.levels().iter().map(|level| {
            if level.z_km == bottom {
                return Ok(Level { z_km: bottom, air: new_surface });
            }
            let taper = (1.0 - (level.z_km - bottom) / TEMPERATURE_TAPER_KM).max(0.0);
            let t = level.air.temperature_k() + warming * taper;
            let old_rh = level.air.relative_humidity_percent();
            // If the lowest level of the profile is completely dry, there is no ratio, and the humidity above stays the same.
            let ratio = if old_surface_rh > 0.0 { surface_rh / old_surface_rh } else { 1.0 };
            let rh = (old_rh * ratio).min(old_rh.max(100.0));
            let e = rh / 100.0 * saturation_pressure_hpa_goff46(t);
            let air = AirState::new(level.air.pressure_hpa() * pressure_ratio, t, e)?;
            Ok(Level { z_km: level.z_km, air })
        });
        Self::new(self.name(), levels.collect::<Result<_, PhysicsError>>()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::reference::reference_profile;

    #[test]
    fn nothing_given_changes_nothing() {
        let profile = reference_profile("mls").unwrap();
        let same = profile.with_surface_weather(&SurfaceWeather::default()).unwrap();
        for (a, b) in profile.levels().iter().zip(same.levels()) {
            assert!((a.air.vapour_pressure_hpa() / b.air.vapour_pressure_hpa() - 1.0).abs() < 1e-12);
            assert_eq!(a.air.pressure_hpa(), b.air.pressure_hpa());
            assert_eq!(a.air.temperature_k(), b.air.temperature_k());
        }
    }

    #[test]
    fn surface_takes_the_weather_and_the_top_stays() {
        let profile = reference_profile("ussa").unwrap();
        let weather =
            SurfaceWeather { pressure_hpa: Some(1000.0), temperature_k: Some(298.0), humidity: Some(Humidity::RelativePercent(80.0)) };
        let hot = profile.with_surface_weather(&weather).unwrap();
        assert_eq!(hot.surface().pressure_hpa(), 1000.0);
        assert_eq!(hot.surface().temperature_k(), 298.0);
        assert!((hot.surface().relative_humidity_percent() - 80.0).abs() < 1e-9);
        let (old_top, new_top) = (profile.air_at(20.0).unwrap(), hot.air_at(20.0).unwrap());
        assert_eq!(old_top.temperature_k(), new_top.temperature_k());
        assert!((new_top.pressure_hpa() / old_top.pressure_hpa() - 1000.0 / 1013.0).abs() < 1e-12);
        assert!(hot.precipitable_water_kg_m2().unwrap() > profile.precipitable_water_kg_m2().unwrap());
        for level in hot.levels() {
            assert!(level.air.relative_humidity_percent() <= 100.0 + 1e-9);
        }
    }

    #[test]
    fn impossible_weather_is_an_error() {
        let profile = reference_profile("ussa").unwrap();
        let bad = [
            SurfaceWeather { temperature_k: Some(0.0), ..SurfaceWeather::default() },
            SurfaceWeather { pressure_hpa: Some(-5.0), ..SurfaceWeather::default() },
            SurfaceWeather { humidity: Some(Humidity::RelativePercent(-1.0)), ..SurfaceWeather::default() },
        ];
        for weather in bad {
            assert!(profile.with_surface_weather(&weather).is_err());
        }
    }
}
