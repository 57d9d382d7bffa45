//! Parts of a row of the material table.

use super::state::Parameter;

/// A parameter of a material: its default, and the values such a material can have at all.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// The parameter.
    pub parameter: Parameter,
    /// Value where none is given.
    pub default: f64,
    /// Least possible value.
    pub min: f64,
    /// Greatest possible value.
    pub max: f64,
}

/// Numbers a material brings to a model that serves several materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Constants {
    /// None needed.
    None,
    /// Row of the P.2040 table.
    P2040(&'static str),
    /// Conductivity, S/m.
    Conductivity(f64),
    /// Fixed permittivity: real part and loss.
    Fixed(f64, f64),
}

/// What limits the water a material can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pores {
    /// Nothing beyond the range of the parameter.
    None,
    /// Pores between solid grains of this density, kg/m3.
    Grains(f64),
}
