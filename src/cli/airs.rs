//! The air of the ray tracer for the errors of the chain.

use super::scene::profile;
use crate::corrupt::{AirModel, AirPaths, AirSource, ExcessPath};
use crate::{ChainError, Result};
use cittert_phenomenology::atmosphere::{Atmosphere, DelayField, PhysicsError, gas_model};
use std::fmt::Display;
use std::sync::Arc;

/// Built-in atmospheres and profiles in files, without clouds, with the default gas model.
pub(super) struct Airs;

impl AirSource for Airs {
    fn air(&self, name: &str) -> Result<Arc<dyn AirModel>> {
        let profile = profile(name).map_err(|e| named(name, &e))?;
        let air = gas_model("mpm89").and_then(|gas| Atmosphere::new(profile, gas)).map_err(|e| named(name, &e))?;
        Ok(Arc::new(TracedAir { name: name.to_owned(), air }))
    }
}

fn named(name: &str, error: &dyn Display) -> ChainError {
    ChainError::Incompatible(format!("atmosphere {name}: {error}"))
}

struct TracedAir {
    name: String,
    air: Atmosphere,
}

impl AirModel for TracedAir {
    fn paths(&self, heights_m: &[f64], freq_hz: &[f64]) -> Result<Box<dyn AirPaths>> {
        let (heights_km, freqs_ghz) = (heights_m.iter().map(|h| h / 1e3), freq_hz.iter().map(|f| f / 1e9));
        let field = self.air.delay_field(&heights_km.collect::<Vec<_>>(), &freqs_ghz.collect::<Vec<_>>());
        field.map(|field| Box::new(TracedPaths(field)) as Box<dyn AirPaths>).map_err(|e| named(&self.name, &e))
    }
}

struct TracedPaths(DelayField);

impl AirPaths for TracedPaths {
    fn toward(&self, place: usize, zenith_rad: f64) -> Result<Vec<ExcessPath>> {
        let delays = self.0.toward(place, zenith_rad.to_degrees()).map_err(|e: PhysicsError| ChainError::Incompatible(e.to_string()))?;
        Ok(delays.iter().map(|d| ExcessPath { wet_m: d.wet_m, other_m: d.total_m() - d.wet_m }).collect())
    }
}
