//! Rows of the emissivity listing.

use super::error::SurfaceError;
use super::model::SurfaceModel;
use super::roughness::Roughness;
use super::stack_file::StackDescription;
use super::wagner_lynch::Sky;
use crate::dielectrics::Extrapolation;
use serde::Serialize;

/// One row: a surface at one frequency and angle. Field names are the column names.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EmissivityRow {
    /// Frequency, GHz.
    pub freq_ghz: f64,
    /// Angle from the normal, degrees.
    pub angle_deg: f64,
    /// Emissivity, h.
    pub emissivity_h: f64,
    /// Emissivity, v.
    pub emissivity_v: f64,
    /// Reflectivity, h.
    pub reflectivity_h: f64,
    /// Reflectivity, v.
    pub reflectivity_v: f64,
    /// Emitted brightness, h, K.
    pub emitted_h_k: f64,
    /// Emitted brightness, v, K.
    pub emitted_v_k: f64,
}

/// Emissivities for every combination of frequencies (outer) and angles (inner, radians).
///
/// `azimuth_rad` matters for facets of unequal slopes only.
///
/// # Errors
/// The first combination that cannot be evaluated.
pub fn emissivity_rows(
    surface: &StackDescription,
    roughness: Roughness,
    freqs_hz: &[f64],
    angles_rad: &[f64],
    azimuth_rad: f64,
    extrapolation: Extrapolation,
) -> Result<Vec<EmissivityRow>, SurfaceError> {
    let cold = |_: f64| 0.0;
    let mut rows = Vec::with_capacity(freqs_hz.len() * angles_rad.len());
    for &freq_hz in freqs_hz {
        let model = SurfaceModel::new(surface.resolve(freq_hz, extrapolation)?, roughness);
        for &angle_rad in angles_rad {
            let r = model.response(angle_rad, azimuth_rad, Sky::Symmetric(&cold))?;
            rows.push(EmissivityRow {
                freq_ghz: freq_hz * 1e-9,
                angle_deg: angle_rad.to_degrees(),
                emissivity_h: r.emissivity[0],
                emissivity_v: r.emissivity[1],
                reflectivity_h: r.reflectivity[0],
                reflectivity_v: r.reflectivity[1],
                emitted_h_k: r.emitted_k[0],
                emitted_v_k: r.emitted_k[1],
            });
        }
    }
    Ok(rows)
}
