//! Absorption by oxygen, water vapour and nitrogen: one model a file, one row here each.
//!
//! Every model turns a state of air into a [`GasSpectrum`]: line strengths, widths and
//! mixing are worked out once for a state, then evaluated at any number of frequencies.

mod catalogue;
mod lines;
mod mpm89;
mod mpm93;
mod nitrogen;

use std::sync::Arc;

use super::air::AirState;
use super::error::PhysicsError;

pub use lines::{DebyeOxygen, GasAbsorption, GasSpectrum, SpectralLine, WaterContinuum};
pub use mpm89::Mpm89;
pub use mpm93::Mpm93;
pub use nitrogen::nitrogen_refractivity_ppm;

/// Power absorption in Np/km of one dB/km: `ln(10)/10`.
pub const NEPER_PER_DECIBEL: f64 = std::f64::consts::LN_10 / 10.0;

/// A line-by-line model of gas absorption, 1-1000 GHz.
pub trait GasModel: std::fmt::Debug + Send + Sync {
    /// Name in the table, as the command line uses it.
    fn name(&self) -> &'static str;

    /// Lines and continua of the model for one state of air.
    fn spectrum(&self, air: &AirState) -> GasSpectrum;
}

/// A row of the table of gas models.
#[derive(Debug, Clone, Copy)]
pub struct GasModelEntry {
    /// Name on the command line.
    pub name: &'static str,
    /// One line for help texts and the book.
    pub summary: &'static str,
    /// Where it was published.
    pub reference: &'static str,
    /// Reads the catalogues of the model.
    pub build: fn() -> Result<Arc<dyn GasModel>, PhysicsError>,
}

/// Every gas model; the first is the default.
pub const GAS_MODELS: &[GasModelEntry] = &[
    GasModelEntry {
        name: mpm89::NAME,
        summary: "30 water vapour and 44 oxygen lines, empirical water continuum (default)",
        reference: "Liebe 1989, Int. J. IR & MM Waves 10, 631",
        build: || Ok(Arc::new(Mpm89::new()?)),
    },
    GasModelEntry {
        name: mpm93::NAME,
        summary: "34 water vapour lines, 44 oxygen lines, water continuum as a line at 1780 GHz",
        reference: "Liebe, Hufford & Cotton 1993, AGARD CP-542",
        build: || Ok(Arc::new(Mpm93::new()?)),
    },
];

/// Finds a gas model by name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn gas_model(name: &str) -> Result<Arc<dyn GasModel>, PhysicsError> {
    match GAS_MODELS.iter().find(|entry| entry.name == name) {
        Some(entry) => (entry.build)(),
        None => Err(PhysicsError::UnknownName {
            kind: "gas absorption model",
            name: name.to_owned(),
            known: GAS_MODELS.iter().map(|e| e.name).collect::<Vec<_>>().join(", "),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_entry_builds_under_its_name() {
        for entry in GAS_MODELS {
            assert_eq!(gas_model(entry.name).unwrap().name(), entry.name);
        }
    }

    #[test]
    fn unknown_model_lists_the_known() {
        let message = gas_model("mpm99").unwrap_err().to_string();
        assert_eq!(message, "unknown gas absorption model 'mpm99'; known: mpm89, mpm93");
    }
}
