//! Vertical profiles of pressure, temperature and vapour.
//!
//! Between levels temperature is linear in height, and pressure and vapour pressure are
//! exponential.

use super::air::{AirState, Humidity};
use super::error::{PhysicsError, check_range};

/// The height where sky integrations end, km.
pub const TOP_OF_ATMOSPHERE_KM: f64 = 30.0;

/// One level of a profile.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Height above the reference, km.
    pub z_km: f64,
    /// Air at that height.
    pub air: AirState,
}

/// A plane-stratified profile: heights increase, pressures decrease.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    name: String,
    levels: Vec<Level>,
}

impl Profile {
    /// Builds a profile from levels, lowest first.
    ///
    /// # Errors
    /// [`PhysicsError::Empty`] for fewer than two levels; [`PhysicsError::Refused`]
    /// when heights do not increase or pressures do not decrease; [`PhysicsError::OutOfRange`]
    /// for heights outside -1 to 100 km.
    pub fn new(name: impl Into<String>, levels: Vec<Level>) -> Result<Self, PhysicsError> {
        let name = name.into();
        if levels.len() < 2 {
            return Err(PhysicsError::Empty { what: "pair of profile levels" });
        }
        for (index, level) in levels.iter().enumerate() {
            check_range("level height", level.z_km, "km", -1.0, 100.0)?;
            let Some(below) = index.checked_sub(1).map(|i| &levels[i]) else {
                continue;
            };
            let order = |quantity: &str, value: f64, previous: f64, unit: &str, rule: &str| {
                let place = format!("profile {name}: {quantity} {value} {unit} at level {}", index + 1);
                PhysicsError::Refused(format!("{place} follows {previous} {unit}; {rule}"))
            };
            if level.z_km <= below.z_km {
                let rule = "list levels from the lowest up, each height once";
                return Err(order("height", level.z_km, below.z_km, "km", rule));
            }
            let (p, p_below) = (level.air.pressure_hpa(), below.air.pressure_hpa());
            if p >= p_below {
                let rule = "pressure must fall with height";
                return Err(order("pressure", p, p_below, "hPa", rule));
            }
        }
        Ok(Self { name, levels })
    }

    /// An isothermal profile with hydrostatic pressure and constant relative humidity, 0-30 km. With a background of the same temperature,
    /// every brightness temperature equals `temperature_k`.
    ///
    /// # Errors
    /// As [`AirState::with_humidity`].
    pub fn isothermal(temperature_k: f64, surface_pressure_hpa: f64, relative_percent: f64) -> Result<Self, PhysicsError> {
        // R T / (M g) of dry air.
        let scale_height_km = 0.029_27 * temperature_k;
        let surface = AirState::with_humidity(surface_pressure_hpa, temperature_k, Humidity::RelativePercent(relative_percent))?;
        let levels = (0..=12).map(|i| {
            let z_km = 2.5 * f64::from(i);
            let fall = (-z_km / scale_height_km).exp();
            let air = AirState::new(surface_pressure_hpa * fall, temperature_k, surface.vapour_pressure_hpa() * fall)?;
            Ok(Level { z_km, air })
        });
        Self::new("isothermal", levels.collect::<Result<_, PhysicsError>>()?)
    }

    /// Name of the profile.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Levels, lowest first.
    #[must_use]
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Lowest height, km.
    #[must_use]
    pub fn bottom_km(&self) -> f64 {
        self.levels[0].z_km
    }

    /// Height where the integrations end, km: 30, or the last level if it is lower.
    #[must_use]
    pub fn top_km(&self) -> f64 {
        self.levels[self.levels.len() - 1].z_km.min(TOP_OF_ATMOSPHERE_KM)
    }

    /// Air at the lowest level.
    #[must_use]
    pub fn surface(&self) -> AirState {
        self.levels[0].air
    }

    /// Air at a height.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside the profile.
    pub fn air_at(&self, z_km: f64) -> Result<AirState, PhysicsError> {
        let last = self.levels.len() - 1;
        check_range("height", z_km, "km", self.bottom_km(), self.levels[last].z_km)?;
        let upper = self.levels.partition_point(|level| level.z_km <= z_km).clamp(1, last);
        let (a, b) = (&self.levels[upper - 1], &self.levels[upper]);
        let w = (z_km - a.z_km) / (b.z_km - a.z_km);
        let linear = |x: f64, y: f64| x + w * (y - x);
        AirState::new(
            exponential_between(a.air.pressure_hpa(), b.air.pressure_hpa(), w),
            linear(a.air.temperature_k(), b.air.temperature_k()),
            exponential_between(a.air.vapour_pressure_hpa(), b.air.vapour_pressure_hpa(), w),
        )
    }
}

#[cfg(test)]
impl Profile {
    /// Vapour in the column from bottom to top, kg/m2, by the trapezium rule on 10 m steps.
    ///
    /// # Errors
    /// As [`Profile::air_at`].
    pub(super) fn precipitable_water_kg_m2(&self) -> Result<f64, PhysicsError> {
        let (bottom, top) = (self.bottom_km(), self.top_km());
        let steps = (((top - bottom) / 0.01).ceil() as usize).max(1);
        let dz = (top - bottom) / steps as f64;
        let mut sum = 0.0;
        for i in 0..=steps {
            let weight = if i == 0 || i == steps { 0.5 } else { 1.0 };
            let z = (bottom + dz * i as f64).min(top);
            sum += weight * self.air_at(z)?.vapour_density_g_m3();
        }
        Ok(sum * dz)
    }
}

/// Interpolates `ln x` linearly, or `x` itself where one end is zero.
fn exponential_between(a: f64, b: f64, w: f64) -> f64 {
    if w == 0.0 {
        a
    } else if w == 1.0 {
        b
    } else if a > 0.0 && b > 0.0 {
        a * (b / a).powf(w)
    } else {
        a + w * (b - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn level(z_km: f64, p: f64, t: f64, e: f64) -> Level {
        Level { z_km, air: AirState::new(p, t, e).unwrap() }
    }

    #[test]
    fn interpolation_is_linear_in_t_and_exponential_in_p_and_e() {
        let profile = Profile::new("x", vec![level(0.0, 1000.0, 290.0, 16.0), level(2.0, 810.0, 280.0, 4.0)]).unwrap();
        let air = profile.air_at(1.0).unwrap();
        assert!((air.pressure_hpa() - 900.0).abs() < 1e-9);
        assert!((air.temperature_k() - 285.0).abs() < 1e-12);
        assert!((air.vapour_pressure_hpa() - 8.0).abs() < 1e-12);
    }

    #[test]
    fn disorder_is_named() {
        let a = level(0.0, 1000.0, 290.0, 1.0);
        let b = level(1.0, 900.0, 285.0, 1.0);
        let swapped = Profile::new("mine", vec![b, a]).unwrap_err().to_string();
        assert!(swapped.contains("profile mine: height 0 km at level 2 follows 1 km"), "{swapped}");
        let heavy = Profile::new("mine", vec![a, level(1.0, 1001.0, 285.0, 1.0)]);
        assert!(heavy.unwrap_err().to_string().contains("pressure must fall with height"));
        assert!(Profile::new("mine", vec![a]).is_err());
    }

    #[test]
    fn heights_outside_are_an_error() {
        let profile = Profile::isothermal(280.0, 1000.0, 50.0).unwrap();
        assert!(profile.air_at(31.0).is_err());
        assert!(profile.air_at(-0.1).is_err());
        assert!(profile.air_at(f64::NAN).is_err());
        assert!(profile.air_at(30.0).is_ok());
    }
}
