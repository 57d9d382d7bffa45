//! Errors of the dielectric data base.

use super::state::{ParameterSpec, Range};
use num_complex::Complex64;
use thiserror::Error;

/// An error of the dielectric data base.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DielectricError {
    /// A name that no table holds.
    #[error("unknown {what} `{name}`; known: {known}")]
    Unknown {
        /// Material, permittivity model or soil texture.
        what: &'static str,
        /// The name given.
        name: String,
        /// The known names, separated by commas.
        known: String,
    },
    /// The model exists but does not describe the material.
    #[error("model `{model}` does not describe `{material}`; its models are: {known}")]
    ModelNotForMaterial {
        /// The model asked for.
        model: &'static str,
        /// The material.
        material: &'static str,
        /// The models of the material, separated by commas.
        known: String,
    },
    /// The material has no such parameter.
    #[error("`{material}` has no parameter `{parameter}`; its parameters are: {known}")]
    NotAParameter {
        /// The material.
        material: &'static str,
        /// The parameter asked for.
        parameter: String,
        /// The parameters of the material, separated by commas.
        known: String,
    },
    /// A value that is impossible for the material.
    #[error("{p} of `{material}` is {value} {u}; it must lie in {min} to {max} {u}", p = spec.parameter, u = spec.parameter.unit(), min = spec.min, max = spec.max)]
    Impossible {
        /// The material.
        material: &'static str,
        /// The parameter and its possible values.
        spec: ParameterSpec,
        /// The value given.
        value: f64,
    },
    /// The temperature in K is zero, negative or not a number.
    #[error("temperature is {0} K; it must be a finite number above 0 K")]
    Temperature(f64),
    /// The frequency in Hz is zero, negative or not a number.
    #[error("frequency is {0} Hz; it must be a finite number above 0 Hz")]
    Frequency(f64),
    /// More water than fits into the pores.
    #[error(
        "moisture {moisture} of `{material}` is above its porosity {porosity:.4} \
         (dry density {density_kg_m3} kg/m3); give less moisture or a lower density"
    )]
    MoistureAbovePorosity {
        /// The material.
        material: &'static str,
        /// Volume fraction of water given.
        moisture: f64,
        /// Volume fraction of the pores.
        porosity: f64,
        /// Dry bulk density, kg/m3.
        density_kg_m3: f64,
    },
    /// The mass fractions of sand and clay exceed one.
    #[error("sand {sand} and clay {clay} add up to more than 1")]
    TextureSum {
        /// Mass fraction of sand.
        sand: f64,
        /// Mass fraction of clay.
        clay: f64,
    },
    /// A parameter lies outside the range of the model.
    #[error(
        "model `{model}` holds for {p} {min} to {max} {u}, not {value} {u} (extension on request: {extension})",
        p = range.parameter, u = range.parameter.unit(), min = range.min, max = range.max
    )]
    OutOfRange {
        /// The model.
        model: &'static str,
        /// The parameter and the range of the model.
        range: Range,
        /// The value given.
        value: f64,
        /// The documented extension.
        extension: &'static str,
    },
    /// The frequency lies outside the bands of the model.
    #[error(
        "model `{model}` of `{material}` holds for {bands} GHz, not {freq_ghz} GHz \
         (extension on request: {extension})"
    )]
    OutOfBand {
        /// The model.
        model: &'static str,
        /// The material.
        material: &'static str,
        /// The frequency given, GHz.
        freq_ghz: f64,
        /// The bands, such as `1-100, 110-330`.
        bands: String,
        /// The documented extension.
        extension: &'static str,
    },
    /// A formula gave an impossible permittivity, far outside its range.
    #[error("model `{model}` gives eps = {eps} for this state, which is not the permittivity of a lossy material")]
    Unphysical {
        /// The model.
        model: &'static str,
        /// What it gave, `eps' - j eps''`.
        eps: Complex64,
    },
    /// The iteration of the mixing formula did not converge.
    #[error("the mixing formula did not converge after {0} iterations")]
    NoConvergence(usize),
    /// A built-in table could not be read.
    #[error("built-in table {table} is damaged: {message}")]
    Table {
        /// Which table.
        table: &'static str,
        /// What is wrong.
        message: String,
    },
}

/// The error for a name that no table holds.
pub(super) fn unknown<'a>(what: &'static str, name: &str, known: impl Iterator<Item = &'a str>) -> DielectricError {
    DielectricError::Unknown { what, name: name.to_owned(), known: join(known) }
}

/// Names separated by commas.
pub(super) fn join<'a>(names: impl Iterator<Item = &'a str>) -> String {
    names.collect::<Vec<_>>().join(", ")
}
