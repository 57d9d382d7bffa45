//! How a scene is rendered.

use crate::error::{Result, SceneError};
use cittert_arrays::Polarization;

/// How radiance is read as a temperature.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scale {
    /// The black body that has this radiance.
    #[default]
    Planck,
    /// Linear in radiance: what visibilities add up.
    RayleighJeans,
}

/// Options of a rendering.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderOptions {
    /// Planes of the picture: `I` is the mean of h and v, `XX` is h (electric field along l), `YY` is v; Q, U, V are
    /// always in Rayleigh-Jeans temperature.
    pub polarizations: Vec<Polarization>,
    /// One temperature for every channel instead of one for the band.
    pub per_channel: bool,
    /// How radiance is read.
    pub scale: Scale,
    /// Rays along each side of a pixel on an edge; 1 for none.
    pub antialias: usize,
    /// Difference between neighbours that makes an edge, K.
    pub edge_k: f64,
    /// Most reflections of a ray.
    pub max_bounces: usize,
    /// Weight below which a ray is followed no further.
    pub min_weight: f64,
    /// Greatest height of any camera the tracer will be used with, m; that of the scene's own camera is always covered.
    pub highest_m: f64,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            polarizations: vec![Polarization::I],
            per_channel: false,
            scale: Scale::Planck,
            antialias: 4,
            edge_k: 2.0,
            max_bounces: 8,
            min_weight: 1e-3,
            highest_m: 0.0,
        }
    }
}

impl RenderOptions {
    /// Checks the ranges, and gives the antenna row of each plane.
    pub(super) fn antenna_rows(&self) -> Result<Vec<[f64; 4]>> {
        let bad = |what: &str, value: String, expected| Err(SceneError::BadValue { what: what.into(), value, expected });
        if !(1..=16).contains(&self.antialias) {
            return bad("antialias", self.antialias.to_string(), "1 to 16 rays along the side of a pixel");
        }
        if self.max_bounces > 1000 {
            return bad("max_bounces", self.max_bounces.to_string(), "at most 1000");
        }
        if !(self.min_weight >= 0.0 && self.min_weight < 1.0) {
            return bad("min_weight", self.min_weight.to_string(), "0 to below 1");
        }
        if !self.highest_m.is_finite() {
            return bad("highest_m", self.highest_m.to_string(), "a finite height in m");
        }
        if !(self.edge_k >= 0.0) {
            return bad("edge_k", self.edge_k.to_string(), "0 K or more");
        }
        if self.polarizations.is_empty() {
            return bad("polarizations", "empty".into(), "at least one of I, Q, U, V, XX (h), YY (v)");
        }
        // The Stokes vector is (T_v + T_h, T_v - T_h, U, V).
        self.polarizations
            .iter()
            .map(|p| match p {
                Polarization::I => Ok([0.5, 0.0, 0.0, 0.0]),
                Polarization::XX => Ok([0.5, -0.5, 0.0, 0.0]),
                Polarization::YY => Ok([0.5, 0.5, 0.0, 0.0]),
                Polarization::Q => Ok([0.0, -0.5, 0.0, 0.0]),
                Polarization::U => Ok([0.0, 0.0, 0.5, 0.0]),
                Polarization::V => Ok([0.0, 0.0, 0.0, 0.5]),
                other => Err(SceneError::BadValue {
                    what: "polarization".into(),
                    value: other.to_string(),
                    expected: "one of I, Q, U, V, XX (h), YY (v)",
                }),
            })
            .collect()
    }
}
