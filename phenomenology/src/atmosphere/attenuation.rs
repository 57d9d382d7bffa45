//! Specific attenuation of one parcel of air, component by component.

use super::air::AirState;
use super::error::{PhysicsError, check_frequencies};
use super::gas::GasModel;
use super::hydrosol::{crystal_attenuation_liebe93, droplet_attenuation_liebe93};
use super::rain::{RainModel, rain_attenuation};

/// A parcel of air with droplets, ice crystals and rain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parcel {
    /// The air.
    pub air: AirState,
    /// Liquid droplets of cloud, fog or haze, g/m3.
    pub liquid_g_m3: f64,
    /// Ice crystals, g/m3.
    pub ice_g_m3: f64,
    /// Rain rate, mm/h.
    pub rain_mm_h: f64,
}

impl Parcel {
    /// Air without water in suspension and without rain.
    #[must_use]
    pub fn clear(air: AirState) -> Self {
        Self { air, liquid_g_m3: 0.0, ice_g_m3: 0.0, rain_mm_h: 0.0 }
    }
}

/// Specific attenuation at one frequency, dB/km.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AttenuationRow {
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Sum of all components; rain as the mean of both polarisations.
    pub attenuation_db_per_km: f64,
    /// Oxygen, lines and continuum.
    pub oxygen_db_per_km: f64,
    /// Water vapour, lines and continuum.
    pub water_vapour_db_per_km: f64,
    /// Nitrogen.
    pub nitrogen_db_per_km: f64,
    /// Liquid droplets.
    pub droplets_db_per_km: f64,
    /// Ice crystals.
    pub ice_db_per_km: f64,
    /// Rain, horizontal polarisation.
    pub rain_h_db_per_km: f64,
    /// Rain, vertical polarisation.
    pub rain_v_db_per_km: f64,
}

impl AttenuationRow {
    /// The numbers with the names of their columns, units included.
    #[must_use]
    pub fn columns(&self) -> [(&'static str, f64); 9] {
        [
            ("freq_ghz", self.freq_ghz),
            ("attenuation_db_per_km", self.attenuation_db_per_km),
            ("oxygen_db_per_km", self.oxygen_db_per_km),
            ("water_vapour_db_per_km", self.water_vapour_db_per_km),
            ("nitrogen_db_per_km", self.nitrogen_db_per_km),
            ("droplets_db_per_km", self.droplets_db_per_km),
            ("ice_db_per_km", self.ice_db_per_km),
            ("rain_h_db_per_km", self.rain_h_db_per_km),
            ("rain_v_db_per_km", self.rain_v_db_per_km),
        ]
    }
}

/// Specific attenuation of a parcel at each frequency in GHz.
///
/// # Errors
/// [`PhysicsError::OutOfRange`] for a frequency outside 1-1000 GHz, a negative amount of
/// water, or water in a phase its temperature does not allow; [`PhysicsError::Empty`]
/// without a frequency.
pub fn attenuation(gas: &GasModel, rain: &dyn RainModel, parcel: &Parcel, freqs_ghz: &[f64]) -> Result<Vec<AttenuationRow>, PhysicsError> {
    check_frequencies(freqs_ghz)?;
    let spectrum = gas.spectrum(&parcel.air);
    let t = parcel.air.temperature_k();
    freqs_ghz
        .iter()
        .map(|&freq_ghz| {
            let gases = spectrum.absorption(freq_ghz);
            // The temperature range of a phase is checked only if the phase is present.
            let droplets = match parcel.liquid_g_m3 {
                0.0 => 0.0,
                density => droplet_attenuation_liebe93(freq_ghz, t, density)?,
            };
            let ice = match parcel.ice_g_m3 {
                0.0 => 0.0,
                density => crystal_attenuation_liebe93(freq_ghz, t, density)?,
            };
            let rain = rain_attenuation(rain, freq_ghz, parcel.rain_mm_h)?;
            Ok(AttenuationRow {
                freq_ghz,
                attenuation_db_per_km: gases.total_db_per_km() + droplets + ice + rain.mean_db_per_km(),
                oxygen_db_per_km: gases.oxygen_db_per_km,
                water_vapour_db_per_km: gases.water_db_per_km,
                nitrogen_db_per_km: gases.nitrogen_db_per_km,
                droplets_db_per_km: droplets,
                ice_db_per_km: ice,
                rain_h_db_per_km: rain.horizontal_db_per_km,
                rain_v_db_per_km: rain.vertical_db_per_km,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::atmosphere::{gas_model, rain_model};

    fn run(parcel: Parcel, freqs: &[f64]) -> Result<Vec<AttenuationRow>, PhysicsError> {
        let (gas, rain) = (gas_model("mpm89").unwrap(), rain_model("p838").unwrap());
        attenuation(gas.as_ref(), rain.as_ref(), &parcel, freqs)
    }

    #[test]
    fn total_is_the_sum_of_its_parts() {
        let air = AirState::new(1000.0, 270.0, 4.0).unwrap();
        let parcel = Parcel { air, liquid_g_m3: 0.1, ice_g_m3: 0.02, rain_mm_h: 5.0 };
        let row = run(parcel, &[94.0]).unwrap()[0];
        let values = row.columns().map(|c| c.1);
        let parts: f64 = values[2..7].iter().sum::<f64>() + 0.5 * (values[7] + values[8]);
        assert!((row.attenuation_db_per_km / parts - 1.0).abs() < 1e-14);
        assert!(values[2..].iter().all(|v| *v > 0.0));
    }

    #[test]
    fn bad_parcels_are_named() {
        let air = AirState::new(1000.0, 290.0, 4.0).unwrap();
        let message = |parcel| run(parcel, &[94.0]).unwrap_err().to_string();
        let clear = Parcel::clear(air);
        assert!(message(Parcel { liquid_g_m3: -0.1, ..clear }).contains("liquid water density -0.1"));
        assert!(message(Parcel { ice_g_m3: 0.1, ..clear }).contains("temperature of ice crystals 290"));
        assert!(message(Parcel { rain_mm_h: f64::NAN, ..clear }).contains("rain rate NaN"));
        assert!(run(clear, &[]).is_err());
    }
}
