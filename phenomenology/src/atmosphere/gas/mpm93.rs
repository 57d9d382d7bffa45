//! MPM93: the water continuum is the wing of a pseudo-line at 1780 GHz.
//!
//! Windows come out 5-25 K warmer in moist air than with MPM89 and today's models.
//! Pressures are in hPa inside this file, as in the tables.
//!
//! # Reference
//! Liebe, Hufford & Cotton 1993, AGARD CP-542, paper 3.

use super::GasModel;
use super::catalogue::read_rows;
use super::lines::{DebyeOxygen, GasSpectrum, SpectralLine, WaterContinuum};
use crate::atmosphere::air::AirState;
use crate::atmosphere::error::PhysicsError;

pub(super) const NAME: &str = "mpm93";

const WATER: &str = include_str!("../../../tables/lines/mpm93_h2o.csv");
const OXYGEN: &str = include_str!("../../../tables/lines/mpm93_o2.csv");

/// The MPM93 model with its catalogues.
#[derive(Debug, Clone)]
pub struct Mpm93 {
    /// f0, b1, b2, b3, b4 (self ratio), b5 (dry exponent), b6 (self exponent).
    water: Vec<[f64; 7]>,
    /// f0, a1 to a6.
    oxygen: Vec<[f64; 7]>,
}

impl Mpm93 {
    /// Reads the catalogues that come with the crate.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if a catalogue is damaged.
    pub fn new() -> Result<Self, PhysicsError> {
        Ok(Self { water: read_rows("mpm93_h2o", WATER)?, oxygen: read_rows("mpm93_o2", OXYGEN)? })
    }
}

impl GasModel for Mpm93 {
    fn name(&self) -> &'static str {
        NAME
    }

    fn spectrum(&self, air: &AirState) -> GasSpectrum {
        let theta = air.theta();
        let ln_theta = theta.ln();
        let power = |exponent: f64| (exponent * ln_theta).exp();
        let e = air.vapour_pressure_hpa();
        let p_d = air.dry_pressure_hpa();

        let vapour_strength = e * power(3.5);
        let water_lines = self
            .water
            .iter()
            .map(|&[f0, b1, b2, b3, b4, b5, b6]| SpectralLine {
                centre_ghz: f0,
                strength: b1 * vapour_strength * (b2 * (1.0 - theta)).exp(),
                width_ghz: b3 * 1e-3 * (p_d * power(b5) + b4 * e * power(b6)),
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
                mixing: (a5 + a6 * theta) * 1e-3 * (p_d + e) * theta_0_8,
            })
            .collect();

        GasSpectrum {
            water_lines,
            water_continuum: WaterContinuum::default(),
            oxygen_lines,
            oxygen_debye: DebyeOxygen { strength: 6.14e-5 * p_d * theta * theta, width_ghz: 0.56e-3 * (p_d + e) * theta_0_8 },
            dry_pressure_hpa: p_d,
            theta,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn catalogue_has_the_published_number_of_lines() {
        let model = Mpm93::new().unwrap();
        assert_eq!((model.water.len(), model.oxygen.len()), (35, 44));
    }
}
