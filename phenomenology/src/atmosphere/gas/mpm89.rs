//! MPM89, the default: close to today's models in the windows.
//!
//! Pressures are in kPa inside this file, as in the paper.
//!
//! # Reference
//! Liebe 1989, Int. J. Infrared and Millimeter Waves 10, 631.

use super::GasModel;
use super::catalogue::read_rows;
use super::lines::{DebyeOxygen, GasSpectrum, SpectralLine, WaterContinuum};
use crate::atmosphere::air::AirState;
use crate::atmosphere::error::PhysicsError;

pub(super) const NAME: &str = "mpm89";

const WATER: &str = include_str!("../../../tables/lines/mpm89_h2o.csv");
const OXYGEN: &str = include_str!("../../../tables/lines/mpm89_o2.csv");

/// The MPM89 model with its catalogues.
#[derive(Debug, Clone)]
pub struct Mpm89 {
    /// f0, b1, b2, b3, b4 (dry exponent), b5 (self ratio), b6 (self exponent).
    water: Vec<[f64; 7]>,
    /// f0, a1 to a6.
    oxygen: Vec<[f64; 7]>,
}

impl Mpm89 {
    /// Reads the catalogues that come with the crate.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if a catalogue is damaged.
    pub fn new() -> Result<Self, PhysicsError> {
        Ok(Self { water: read_rows("mpm89_h2o", WATER)?, oxygen: read_rows("mpm89_o2", OXYGEN)? })
    }
}

impl GasModel for Mpm89 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn spectrum(&self, air: &AirState) -> GasSpectrum {
        let theta = air.theta();
        let ln_theta = theta.ln();
        let power = |exponent: f64| (exponent * ln_theta).exp();
        let e = air.vapour_pressure_hpa() / 10.0;
        let p_d = air.dry_pressure_hpa() / 10.0;

        let vapour_strength = e * power(3.5);
        let water_lines = self
            .water
            .iter()
            .map(|&[f0, b1, b2, b3, b4, b5, b6]| SpectralLine {
                centre_ghz: f0,
                strength: b1 * vapour_strength * (b2 * (1.0 - theta)).exp(),
                width_ghz: b3 * 1e-3 * (p_d * power(b4) + b5 * e * power(b6)),
                mixing: 0.0,
            })
            .collect();

        let theta_0_8 = power(0.8);
        let oxygen_strength = 1e-6 * p_d * theta.powi(3);
        let oxygen_lines = self
            .oxygen
            .iter()
            .map(|&[f0, a1, a2, a3, a4, a5, a6]| SpectralLine {
                centre_ghz: f0,
                strength: a1 * oxygen_strength * (a2 * (1.0 - theta)).exp(),
                width_ghz: a3 * 1e-3 * (p_d * power(0.8 - a4) + 1.1 * e * theta),
                // In MPM89 only the dry air mixes lines.
                mixing: (a5 + a6 * theta) * 1e-3 * p_d * theta_0_8,
            })
            .collect();

        GasSpectrum {
            water_lines,
            water_continuum: WaterContinuum { slope_ppm_per_ghz: e * theta.powi(3) * 1e-5 * (0.113 * p_d + 3.57 * e * power(7.5)) },
            oxygen_lines,
            oxygen_debye: DebyeOxygen { strength: 6.14e-4 * p_d * theta * theta, width_ghz: 5.6e-3 * (p_d + e) * theta_0_8 },
            dry_pressure_hpa: air.dry_pressure_hpa(),
            theta,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn catalogue_has_the_published_number_of_lines() {
        let model = Mpm89::new().unwrap();
        assert_eq!((model.water.len(), model.oxygen.len()), (30, 44));
    }

    #[test]
    fn dry_air_has_no_water_absorption() {
        let air = AirState::new(1013.0, 288.0, 0.0).unwrap();
        let absorption = Mpm89::new().unwrap().spectrum(&air).absorption(183.31);
        assert_eq!(absorption.water_db_per_km, 0.0);
        assert!(absorption.oxygen_db_per_km > 0.0);
    }
}
