//! What the errors know of the air: how much longer a path through it is than in vacuum. The models of the air are given from outside.

use crate::Result;
use serde::{Serialize, Serializer};
use std::fmt;
use std::sync::Arc;

/// Excess path length, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExcessPath {
    /// Of water vapour.
    pub wet_m: f64,
    /// Of everything else: dry air, droplets, and the longer way of a bent ray.
    pub other_m: f64,
}

/// A model of the air.
pub trait AirModel: Send + Sync {
    /// The paths of places at heights above sea level in m, at frequencies in Hz.
    ///
    /// # Errors
    /// A height or a frequency is outside the range of the model.
    fn paths(&self, heights_m: &[f64], freq_hz: &[f64]) -> Result<Box<dyn AirPaths>>;
}

/// Paths through the air from several places.
pub trait AirPaths {
    /// Excess paths from a place towards a source beyond the air, whose true zenith angle there is given \[chan\].
    ///
    /// # Errors
    /// The source is below the horizon.
    fn toward(&self, place: usize, zenith_rad: f64) -> Result<Vec<ExcessPath>>;
}

/// Finds the air of a name.
pub trait AirSource {
    /// The air of a name, such as that of a reference atmosphere or of a file.
    ///
    /// # Errors
    /// There is no air of this name, or its file cannot be read.
    fn air(&self, name: &str) -> Result<Arc<dyn AirModel>>;
}

/// A model of the air with its name.
#[derive(Clone)]
pub struct Air {
    /// Name of the atmosphere, as it was given.
    pub name: String,
    /// The model.
    pub model: Arc<dyn AirModel>,
}

impl fmt::Debug for Air {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.name.fmt(f)
    }
}

impl PartialEq for Air {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Serialize for Air {
    fn serialize<S: Serializer>(&self, s: S) -> std::result::Result<S::Ok, S::Error> {
        self.name.serialize(s)
    }
}
