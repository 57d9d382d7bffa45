//! The table of gas models.

use super::liebe::LiebeModel;
use super::model::GasModel;
use super::{mpm89, mpm93};
use crate::atmosphere::error::{PhysicsError, find_by_name};
use std::sync::Arc;

/// A row of the table of gas models.
#[derive(Debug, Clone, Copy)]
pub struct GasModelEntry {
    /// Name of the model.
    pub name: &'static str,
    /// One line for help texts and the book.
    pub summary: &'static str,
    /// Publication.
    pub reference: &'static str,
    /// Reads the line catalogues of the model.
    pub build: fn() -> Result<Arc<dyn GasModel>, PhysicsError>,
}

/// Every gas model. The first is the default.
pub const GAS_MODELS: &[GasModelEntry] = &[
    GasModelEntry {
        name: mpm89::MPM89.name,
        summary: "30 water vapour and 44 oxygen lines, empirical water continuum (default)",
        reference: "Liebe 1989, Int. J. IR & MM Waves 10, 631",
        build: || Ok(Arc::new(LiebeModel::new(&mpm89::MPM89)?)),
    },
    GasModelEntry {
        name: mpm93::MPM93.name,
        summary: "34 water vapour lines, 44 oxygen lines, water continuum as a line at 1780 GHz",
        reference: "Liebe, Hufford & Cotton 1993, AGARD CP-542",
        build: || Ok(Arc::new(LiebeModel::new(&mpm93::MPM93)?)),
    },
];

/// The gas model of a name.
///
/// # Errors
/// [`PhysicsError::UnknownName`] with the known names.
pub fn gas_model(name: &str) -> Result<Arc<dyn GasModel>, PhysicsError> {
    (find_by_name("gas absorption model", name, GAS_MODELS, |e| e.name)?.build)()
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
