//! The water of a cloud: droplets, ice crystals and rain together.

use super::error::{PhysicsError, check_range};
use super::gas::NEPER_PER_DECIBEL;
use super::hydrosol::{MAX_DENSITY_G_M3, crystal_attenuation_liebe93, droplet_attenuation_liebe93};
use super::rain::{RainModel, rain_attenuation};

/// Droplets, ice crystals and rain in a volume of air.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Hydrometeors {
    /// Liquid droplets of cloud, fog or haze, g/m3.
    pub liquid_g_m3: f64,
    /// Ice crystals, g/m3.
    pub ice_g_m3: f64,
    /// Rain rate, mm/h.
    pub rain_mm_h: f64,
}

impl Hydrometeors {
    /// Checks the amounts against the ranges of the models.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] for a negative or too large amount; [`PhysicsError::Empty`] if all amounts are zero.
    pub fn check(&self, rain: &dyn RainModel) -> Result<(), PhysicsError> {
        check_range("liquid water density", self.liquid_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
        check_range("ice density", self.ice_g_m3, "g/m3", 0.0, MAX_DENSITY_G_M3)?;
        check_range("rain rate", self.rain_mm_h, "mm/h", 0.0, rain.max_rate_mm_h())?;
        if *self == Self::default() { Err(PhysicsError::Empty { what: "amount of water" }) } else { Ok(()) }
    }

    /// Power absorption at a frequency and a temperature, Np/km. Rain counts with the mean of both polarisations.
    ///
    /// The temperature range of a phase is checked only if the phase is present.
    ///
    /// # Errors
    /// [`PhysicsError::OutOfRange`] outside 1-1000 GHz, or for a phase that the temperature does not allow.
    pub fn absorption_np_per_km(&self, rain: &dyn RainModel, freq_ghz: f64, temperature_k: f64) -> Result<f64, PhysicsError> {
        let mut db_per_km = 0.0;
        if self.liquid_g_m3 != 0.0 {
            db_per_km += droplet_attenuation_liebe93(freq_ghz, temperature_k, self.liquid_g_m3)?;
        }
        if self.ice_g_m3 != 0.0 {
            db_per_km += crystal_attenuation_liebe93(freq_ghz, temperature_k, self.ice_g_m3)?;
        }
        if self.rain_mm_h != 0.0 {
            db_per_km += rain_attenuation(rain, freq_ghz, self.rain_mm_h)?.mean_db_per_km();
        }
        Ok(db_per_km * NEPER_PER_DECIBEL)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::{AirState, Parcel, attenuation, gas_model, rain_model};

    #[test]
    fn the_parts_are_those_of_a_parcel_of_air() {
        let (gas, rain) = (gas_model("mpm89").unwrap(), rain_model("p838").unwrap());
        let water = Hydrometeors { liquid_g_m3: 0.1, ice_g_m3: 0.02, rain_mm_h: 5.0 };
        let air = AirState::new(1000.0, 270.0, 4.0).unwrap();
        let db = |p: Parcel| attenuation(gas.as_ref(), rain.as_ref(), &p, &[94.0]).unwrap()[0].attenuation_db_per_km;
        let wet = Parcel { air, liquid_g_m3: 0.1, ice_g_m3: 0.02, rain_mm_h: 5.0 };
        let want = (db(wet) - db(Parcel::clear(air))) * NEPER_PER_DECIBEL;
        let got = water.absorption_np_per_km(rain.as_ref(), 94.0, 270.0).unwrap();
        assert!((got / want - 1.0).abs() < 1e-12, "{got} {want}");
    }

    #[test]
    fn impossible_amounts_are_named() {
        let rain = rain_model("p838").unwrap();
        let message = |w: Hydrometeors| w.check(rain.as_ref()).unwrap_err().to_string();
        assert!(message(Hydrometeors::default()).contains("amount of water"));
        assert!(message(Hydrometeors { liquid_g_m3: -0.1, ..Hydrometeors::default() }).contains("liquid water density -0.1"));
        assert!(message(Hydrometeors { ice_g_m3: f64::NAN, ..Hydrometeors::default() }).contains("ice density NaN"));
        let warm = Hydrometeors { ice_g_m3: 0.1, ..Hydrometeors::default() }.absorption_np_per_km(rain.as_ref(), 94.0, 290.0);
        assert!(warm.unwrap_err().to_string().contains("temperature of ice crystals 290"));
    }
}
