//! Rows of the permittivity listing.

use super::error::DielectricError;
use super::material::Material;
use super::model::{Extrapolation, Model};
use super::state::MaterialState;
use serde::Serialize;

/// One row: a material in one state at one frequency. Field names are the column names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PermittivityRow {
    /// Material.
    pub material: &'static str,
    /// Model that gave the number.
    pub model: &'static str,
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Temperature, K.
    pub temperature_k: f64,
    /// Salinity, psu.
    pub salinity_psu: f64,
    /// Water fraction.
    pub moisture: f64,
    /// Dry density, kg/m3.
    pub density_kg_m3: f64,
    /// Real part.
    pub eps_real: f64,
    /// Loss, positive.
    pub eps_loss: f64,
    /// Whether the documented extension of the model was used.
    pub extended: bool,
}

/// Permittivities for every combination of states (outer) and frequencies (inner).
///
/// # Errors
/// The first state or frequency that cannot be evaluated, see [`Material::evaluate`].
pub fn permittivity_rows(
    material: &'static Material,
    model: Option<&'static Model>,
    states: &[MaterialState],
    freqs_hz: &[f64],
    extrapolation: Extrapolation,
) -> Result<Vec<PermittivityRow>, DielectricError> {
    let mut rows = Vec::with_capacity(states.len() * freqs_hz.len());
    for state in states {
        for &freq_hz in freqs_hz {
            let p = material.evaluate(model, state, freq_hz, extrapolation)?;
            rows.push(PermittivityRow {
                material: material.name,
                model: p.model.name,
                freq_ghz: freq_hz * 1e-9,
                temperature_k: state.temperature_k,
                salinity_psu: state.salinity_psu,
                moisture: state.moisture,
                density_kg_m3: state.density_kg_m3,
                eps_real: p.eps.re,
                eps_loss: -p.eps.im,
                extended: p.extended,
            });
        }
    }
    Ok(rows)
}
