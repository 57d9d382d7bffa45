//! The weather of a scene at the frequencies of a tracer.

use crate::atmosphere::planck::black_body_radiance;
use crate::error::{Result, SceneError};
use crate::geometry::{At, Passage};
use crate::solids::{self, WeatherSource};
use rayon::prelude::*;

/// The weather of a scene at the frequencies of a tracer.
#[derive(Debug)]
pub(super) struct Weather<'a> {
    pub source: &'a solids::Weather,
    /// // [volume]
    pub bodies: Vec<Tables>,
}

/// Absorption and source of one body.
#[derive(Debug)]
pub(super) struct Tables {
    low_m: f64,
    /// Number of steps in a metre of height.
    steps_per_m: f64,
    /// Absorption at even steps of height, Np/m. // [chan][step]
    absorption: Vec<Vec<f64>>,
    /// Black-body radiance of water with a temperature of its own. // [chan]
    pub radiance: Option<Vec<f64>>,
}

/// Working memory of a leg.
#[derive(Debug, Clone, Default)]
pub(super) struct Cuts {
    pub passages: Vec<Passage>,
    /// Distances at which a body begins or ends, m.
    pub at_m: Vec<f64>,
    /// Bodies around the part at hand.
    pub inside: Vec<u32>,
}

impl<'a> Weather<'a> {
    /// Tabulates the weather of a scene at frequencies in GHz.
    ///
    /// # Errors
    /// A frequency outside 1-1000 GHz.
    pub(super) fn new(source: &'a solids::Weather, freqs_ghz: &[f64]) -> Result<Self> {
        let bodies = source.bodies.par_iter().map(|b| Tables::new(b, source, freqs_ghz)).collect::<Result<_>>()?;
        Ok(Self { source, bodies })
    }
}

impl Tables {
    fn new(body: &WeatherSource, weather: &solids::Weather, freqs_ghz: &[f64]) -> Result<Self> {
        let per_m = |freq: f64, t: f64| Ok(1e-3 * body.water.absorption_np_per_km(weather.rain.as_ref(), freq, t)?);
        let absorption = freqs_ghz
            .iter()
            .map(|f| body.water_k.iter().map(|t| per_m(*f, *t)).collect::<Result<Vec<f64>, _>>())
            .collect::<Result<_, _>>()
            .map_err(|cause| SceneError::Weather { at: At(body.line), name: body.name.clone(), source: Box::new(cause) })?;
        let [low_m, high_m] = body.heights_m;
        let steps_per_m = (body.water_k.len() - 1) as f64 / (high_m - low_m);
        let radiance = body.emits_k.map(|t| freqs_ghz.iter().map(|f| black_body_radiance(*f, t)).collect());
        Ok(Self { low_m, steps_per_m: if steps_per_m.is_finite() { steps_per_m } else { 0.0 }, absorption, radiance })
    }

    /// Absorption at a height, Np/m.
    pub(super) fn absorption(&self, channel: usize, z_m: f64) -> f64 {
        let table = &self.absorption[channel];
        let u = ((z_m - self.low_m) * self.steps_per_m).clamp(0.0, (table.len() - 1) as f64);
        let k = (u as usize).min(table.len().saturating_sub(2));
        let next = table[(k + 1).min(table.len() - 1)];
        table[k] + (u - k as f64) * (next - table[k])
    }
}
