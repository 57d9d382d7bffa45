//! The state of a material: the parameters its permittivity depends on.

use serde::{Deserialize, Serialize};
use std::fmt;

/// A parameter a permittivity depends on, besides frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Parameter {
    /// Physical temperature, K.
    Temperature,
    /// Salinity, psu (parts per thousand by mass).
    Salinity,
    /// Volume fraction of liquid water; in leaves the mass fraction.
    Moisture,
    /// Dry bulk density, kg/m3.
    Density,
    /// Mass fraction of sand in the mineral part.
    Sand,
    /// Mass fraction of clay in the mineral part.
    Clay,
}

impl Parameter {
    /// Every parameter, in the order tables list them.
    pub const ALL: [Self; 6] = [Self::Temperature, Self::Salinity, Self::Moisture, Self::Density, Self::Sand, Self::Clay];

    /// Name of the option, key in files, and unit of each, in the same order.
    const NAMES: [[&'static str; 3]; 6] = [
        ["temperature", "temperature_k", "K"],
        ["salinity", "salinity_psu", "psu"],
        ["moisture", "moisture", "(fraction)"],
        ["density", "density_kg_m3", "kg/m3"],
        ["sand", "sand", "(fraction)"],
        ["clay", "clay", "(fraction)"],
    ];

    /// The name of the option, such as `salinity`.
    #[must_use]
    pub fn name(self) -> &'static str {
        Self::NAMES[self as usize][0]
    }

    /// The key used in files, with its unit, such as `salinity_psu`.
    #[must_use]
    pub fn key(self) -> &'static str {
        Self::NAMES[self as usize][1]
    }

    /// The unit of the value.
    #[must_use]
    pub fn unit(self) -> &'static str {
        Self::NAMES[self as usize][2]
    }

    /// The parameter whose option name or file key this is.
    #[must_use]
    pub fn by_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|p| p.name() == name || p.key() == name)
    }
}

impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// The range of one parameter of a model, both ends included.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Range {
    /// The parameter.
    pub parameter: Parameter,
    /// Lower end.
    pub min: f64,
    /// Upper end.
    pub max: f64,
}

/// A parameter of a material: its default and its possible values.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct ParameterSpec {
    /// The parameter.
    pub parameter: Parameter,
    /// Value if none is given.
    pub default: f64,
    /// Least possible value.
    pub min: f64,
    /// Greatest possible value.
    pub max: f64,
}

/// Values of all parameters of one material sample.
///
/// [`Material::state`](super::Material::state) gives a state with the defaults of a material. The models of a material ignore parameters
/// that the material does not have.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MaterialState {
    /// Physical temperature, K.
    pub temperature_k: f64,
    /// Salinity, psu.
    pub salinity_psu: f64,
    /// Volume fraction of liquid water (leaves: mass fraction).
    pub moisture: f64,
    /// Dry bulk density, kg/m3.
    pub density_kg_m3: f64,
    /// Mass fraction of sand.
    pub sand: f64,
    /// Mass fraction of clay.
    pub clay: f64,
}

impl MaterialState {
    fn place(&mut self, parameter: Parameter) -> &mut f64 {
        match parameter {
            Parameter::Temperature => &mut self.temperature_k,
            Parameter::Salinity => &mut self.salinity_psu,
            Parameter::Moisture => &mut self.moisture,
            Parameter::Density => &mut self.density_kg_m3,
            Parameter::Sand => &mut self.sand,
            Parameter::Clay => &mut self.clay,
        }
    }

    /// The value of one parameter.
    #[must_use]
    pub fn get(mut self, parameter: Parameter) -> f64 {
        *self.place(parameter)
    }

    /// Sets the value of one parameter. It is checked when a permittivity is computed.
    pub fn set(&mut self, parameter: Parameter, value: f64) {
        *self.place(parameter) = value;
    }
}
