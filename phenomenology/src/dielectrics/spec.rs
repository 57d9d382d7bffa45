//! Parts of a row of the material table.

use super::state::Parameter;

/// A parameter of a material: its default and its possible values.
#[derive(Debug, Clone, Copy, PartialEq)]
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

/// Constants of a material for a model that describes several materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constants {
    /// No constants.
    None,
    /// Row of the P.2040 table.
    P2040(&'static str),
    /// Conductivity, S/m.
    Conductivity(f64),
    /// Fixed permittivity: real part and loss.
    Fixed(f64, f64),
}

/// The limit of the water that a material can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pores {
    /// The range of the parameter alone.
    None,
    /// The pores between solid grains of this density, kg/m3.
    Grains(f64),
}
