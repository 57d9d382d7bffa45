//! The form that the models of Liebe share: lines of water vapour and oxygen from catalogues, a water continuum, and the Debye
//! absorption of oxygen.

use super::lines::{DebyeOxygen, GasSpectrum, SpectralLine, WaterContinuum};
use super::model::GasModel;
use crate::atmosphere::air::AirState;
use crate::atmosphere::csv_table::CsvTable;
use crate::atmosphere::error::PhysicsError;

/// The parts that differ between the models of this form.
#[derive(Debug)]
pub(super) struct Recipe {
    pub name: &'static str,
    /// Name and text of the catalogue of water vapour lines: f0, b1, b2, b3, and three coefficients of the width.
    pub water: (&'static str, &'static str),
    /// Positions in a row of water vapour: exponent of the dry air, factor of the vapour, exponent of the vapour.
    pub width: [usize; 3],
    /// Name and text of the catalogue of oxygen lines: f0, a1 to a6.
    pub oxygen: (&'static str, &'static str),
    /// Unit of pressure of the catalogues, hPa.
    pub unit_hpa: f64,
    /// Whether water vapour mixes oxygen lines as dry air does.
    pub vapour_mixes: bool,
    /// Slope of the water continuum, ppm/GHz, from dry pressure and vapour pressure in the unit of the catalogues, and theta.
    pub continuum: fn(f64, f64, f64) -> f64,
}

/// A model of this form with its catalogues.
#[derive(Debug)]
pub(super) struct LiebeModel {
    recipe: &'static Recipe,
    pub(super) water: Vec<[f64; 7]>,
    pub(super) oxygen: Vec<[f64; 7]>,
}

impl LiebeModel {
    /// Reads the catalogues of a model.
    ///
    /// # Errors
    /// [`PhysicsError::Table`] if a catalogue is damaged.
    pub(super) fn new(recipe: &'static Recipe) -> Result<Self, PhysicsError> {
        let read = |(name, text)| CsvTable::read(name, text)?.numbers();
        Ok(Self { recipe, water: read(recipe.water)?, oxygen: read(recipe.oxygen)? })
    }
}

impl GasModel for LiebeModel {
    fn name(&self) -> &'static str {
        self.recipe.name
    }

    fn spectrum(&self, air: &AirState) -> GasSpectrum {
        let theta = air.theta();
        let ln_theta = theta.ln();
        let power = |exponent: f64| (exponent * ln_theta).exp();
        let unit = self.recipe.unit_hpa;
        let (p_d, e) = (air.dry_pressure_hpa() / unit, air.vapour_pressure_hpa() / unit);

        let vapour_strength = e * power(3.5);
        let [dry_exponent, ratio, exponent] = self.recipe.width;
        let water_lines = self
            .water
            .iter()
            .map(|row| SpectralLine {
                centre_ghz: row[0],
                strength: row[1] * vapour_strength * (row[2] * (1.0 - theta)).exp(),
                width_ghz: row[3] * 1e-3 * (p_d * power(row[dry_exponent]) + row[ratio] * e * power(row[exponent])),
                mixing: 0.0,
            })
            .collect();

        let theta_0_8 = power(0.8);
        let oxygen_strength = 1e-6 * p_d * theta.powi(3);
        let mixing_pressure = if self.recipe.vapour_mixes { p_d + e } else { p_d };
        let oxygen_lines = self
            .oxygen
            .iter()
            .map(|&[f0, a1, a2, a3, a4, a5, a6]| SpectralLine {
                centre_ghz: f0,
                strength: a1 * oxygen_strength * (a2 * (1.0 - theta)).exp(),
                width_ghz: a3 * 1e-3 * (p_d * power(0.8 - a4) + 1.1 * e * theta),
                mixing: (a5 + a6 * theta) * 1e-3 * mixing_pressure * theta_0_8,
            })
            .collect();

        GasSpectrum {
            water_lines,
            water_continuum: WaterContinuum { slope_ppm_per_ghz: (self.recipe.continuum)(p_d, e, theta) },
            oxygen_lines,
            oxygen_debye: DebyeOxygen {
                strength: 6.14e-5 * air.dry_pressure_hpa() * theta * theta,
                width_ghz: 0.56e-3 * air.pressure_hpa() * theta_0_8,
            },
            dry_pressure_hpa: air.dry_pressure_hpa(),
            theta,
        }
    }
}
