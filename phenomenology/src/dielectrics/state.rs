//! The state of a material: the parameters its permittivity depends on.

use serde::Serialize;
use std::fmt;

/// A parameter a permittivity depends on, besides frequency.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize)]
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

    /// The name of the option, such as `salinity`.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Temperature => "temperature",
            Self::Salinity => "salinity",
            Self::Moisture => "moisture",
            Self::Density => "density",
            Self::Sand => "sand",
            Self::Clay => "clay",
        }
    }

    /// The key used in files, with its unit, such as `salinity_psu`.
    #[must_use]
    pub fn key(self) -> &'static str {
        match self {
            Self::Temperature => "temperature_k",
            Self::Salinity => "salinity_psu",
            Self::Density => "density_kg_m3",
            Self::Moisture | Self::Sand | Self::Clay => self.name(),
        }
    }

    /// The unit of the value.
    #[must_use]
    pub fn unit(self) -> &'static str {
        match self {
            Self::Temperature => "K",
            Self::Salinity => "psu",
            Self::Density => "kg/m3",
            Self::Moisture | Self::Sand | Self::Clay => "(fraction)",
        }
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
    /// The value of one parameter.
    #[must_use]
    pub fn get(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Temperature => self.temperature_k,
            Parameter::Salinity => self.salinity_psu,
            Parameter::Moisture => self.moisture,
            Parameter::Density => self.density_kg_m3,
            Parameter::Sand => self.sand,
            Parameter::Clay => self.clay,
        }
    }

    /// Sets the value of one parameter. It is checked when a permittivity is computed.
    pub fn set(&mut self, parameter: Parameter, value: f64) {
        match parameter {
            Parameter::Temperature => self.temperature_k = value,
            Parameter::Salinity => self.salinity_psu = value,
            Parameter::Moisture => self.moisture = value,
            Parameter::Density => self.density_kg_m3 = value,
            Parameter::Sand => self.sand = value,
            Parameter::Clay => self.clay = value,
        }
    }
}
