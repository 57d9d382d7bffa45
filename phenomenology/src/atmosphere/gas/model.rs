//! The models of gas absorption. They are of one form, due to Liebe: lines of water vapour and oxygen from catalogues, a water continuum, and
//! the Debye absorption of oxygen.

use super::lines::{DebyeOxygen, GasSpectrum, SpectralLine};
use crate::atmosphere::air::AirState;
use crate::atmosphere::csv_table::CsvTable;
use crate::atmosphere::error::{PhysicsError, find_by_name};
use std::sync::Arc;

/// A row of the table of gas models.
#[derive(Debug)]
pub struct GasModelEntry {
    /// Name of the model.
    pub name: &'static str,
    /// One line for help texts and the book.
    pub summary: &'static str,
    /// Publication.
    pub reference: &'static str,
    /// Name and text of the catalogue of water vapour lines: f0, b1, b2, b3, and three coefficients of the width.
    water: (&'static str, &'static str),
    /// Positions in a row of water vapour: exponent of the dry air, factor of the vapour, exponent of the vapour.
    width: [usize; 3],
    /// Name and text of the catalogue of oxygen lines: f0, a1 to a6.
    oxygen: (&'static str, &'static str),
    /// Unit of pressure of the catalogues, hPa.
    unit_hpa: f64,
    /// Whether water vapour mixes oxygen lines as dry air does.
    vapour_mixes: bool,
    /// Slope of the water continuum, ppm/GHz, from dry pressure and vapour pressure in the unit of the catalogues, and theta.
    continuum: fn(f64, f64, f64) -> f64,
    /// Factor of `f^2.05` in the real refractivity of the water continuum, ppm, from the vapour pressure in the unit of the catalogues, and
    /// theta.
    continuum_dispersion: fn(f64, f64) -> f64,
}

/// Every gas model. The first is the default.
pub const GAS_MODELS: &[GasModelEntry] = &[
    // In the atmospheric windows it is close to the models of today.
    GasModelEntry {
        name: "mpm89",
        summary: "30 water vapour and 44 oxygen lines, empirical water continuum (default)",
        reference: "Liebe 1989, Int. J. IR & MM Waves 10, 631",
        water: ("mpm89_h2o", include_str!("../../../tables/lines/mpm89_h2o.csv")),
        oxygen: ("mpm89_o2", include_str!("../../../tables/lines/mpm89_o2.csv")),
        // Row: f0, b1, b2, b3, b4 (exponent of dry air), b5 (ratio of vapour), b6 (exponent of vapour).
        width: [4, 5, 6],
        unit_hpa: 10.0,
        vapour_mixes: false,
        continuum: |p_d, e, theta| e * theta.powi(3) * 1e-5 * (0.113 * p_d + 3.57 * e * theta.powf(7.5)),
        continuum_dispersion: |e, theta| 6.47e-6 * e * theta.powf(2.4),
    },
    // The water continuum is the wing of a pseudo-line at 1780 GHz, so there is no separate continuum. In moist air the sky temperature in
    // the windows is 5-25 K higher than with MPM89 and with recent models.
    GasModelEntry {
        name: "mpm93",
        summary: "34 water vapour lines, 44 oxygen lines, water continuum as a line at 1780 GHz",
        reference: "Liebe, Hufford & Cotton 1993, AGARD CP-542",
        water: ("mpm93_h2o", include_str!("../../../tables/lines/mpm93_h2o.csv")),
        oxygen: ("mpm93_o2", include_str!("../../../tables/lines/mpm93_o2.csv")),
        // Row: f0, b1, b2, b3, b4 (ratio of vapour), b5 (exponent of dry air), b6 (exponent of vapour).
        width: [5, 4, 6],
        unit_hpa: 1.0,
        vapour_mixes: true,
        continuum: |_, _, _| 0.0,
        continuum_dispersion: |_, _| 0.0,
    },
];

/// The gas model of a name, with its catalogues.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn gas_model(name: &str) -> Result<Arc<GasModel>, PhysicsError> {
    let entry = find_by_name("gas absorption model", name, GAS_MODELS, |e| e.name)?;
    let read = |(name, text)| CsvTable::read(name, text)?.numbers();
    Ok(Arc::new(GasModel { entry, water: read(entry.water)?, oxygen: read(entry.oxygen)? }))
}

/// A line-by-line model of gas absorption, 1-1000 GHz.
#[derive(Debug)]
pub struct GasModel {
    entry: &'static GasModelEntry,
    water: Vec<[f64; 7]>,
    oxygen: Vec<[f64; 7]>,
}

impl GasModel {
    /// Lines and continua of the model for one state of air.
    #[must_use]
    pub fn spectrum(&self, air: &AirState) -> GasSpectrum {
        let theta = air.theta();
        let ln_theta = theta.ln();
        let power = |exponent: f64| (exponent * ln_theta).exp();
        let unit = self.entry.unit_hpa;
        let (p_d, e) = (air.dry_pressure_hpa() / unit, air.vapour_pressure_hpa() / unit);

        let vapour_strength = e * power(3.5);
        let [dry_exponent, ratio, exponent] = self.entry.width;
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
        let mixing_pressure = if self.entry.vapour_mixes { p_d + e } else { p_d };
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
            water_continuum_ppm_per_ghz: (self.entry.continuum)(p_d, e, theta),
            water_continuum_dispersion_ppm: (self.entry.continuum_dispersion)(e, theta),
            oxygen_lines,
            oxygen_debye: DebyeOxygen {
                strength: 6.14e-5 * air.dry_pressure_hpa() * theta * theta,
                width_ghz: 0.56e-3 * air.pressure_hpa() * theta_0_8,
            },
            dry_pressure_hpa: air.dry_pressure_hpa(),
            vapour_pressure_hpa: air.vapour_pressure_hpa(),
            theta,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn catalogues_have_the_published_number_of_lines() {
        for (name, lines) in [("mpm89", (30, 44)), ("mpm93", (35, 44))] {
            let model = gas_model(name).unwrap();
            assert_eq!((model.water.len(), model.oxygen.len()), lines);
        }
    }

    #[test]
    fn dry_air_has_no_water_absorption() {
        let air = AirState::new(1013.0, 288.0, 0.0).unwrap();
        let absorption = gas_model("mpm89").unwrap().spectrum(&air).absorption(183.31);
        assert_eq!(absorption.water_db_per_km, 0.0);
        assert!(absorption.oxygen_db_per_km > 0.0);
    }

    #[test]
    fn unknown_model_lists_the_known() {
        let message = gas_model("mpm99").unwrap_err().to_string();
        assert_eq!(message, "unknown gas absorption model 'mpm99'; known: mpm89, mpm93");
    }
}
