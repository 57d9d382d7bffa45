//! Errors of the dielectric data base.

use super::state::Parameter;
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
    #[error("{parameter} of `{material}` is {value} {unit}; it must lie in {min} to {max} {unit}")]
    Impossible {
        /// The material.
        material: &'static str,
        /// The parameter.
        parameter: Parameter,
        /// The value given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// The least possible value.
        min: f64,
        /// The greatest possible value.
        max: f64,
    },
    /// The temperature is zero, negative or not a number.
    #[error("temperature is {value} K; it must be a finite number above 0 K")]
    Temperature {
        /// The value given, K.
        value: f64,
    },
    /// The frequency is zero, negative or not a number.
    #[error("frequency is {value} Hz; it must be a finite number above 0 Hz")]
    Frequency {
        /// The value given, Hz.
        value: f64,
    },
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
        "model `{model}` holds for {parameter} {min} to {max} {unit}, not {value} {unit} \
         (extension on request: {extension})"
    )]
    OutOfRange {
        /// The model.
        model: &'static str,
        /// The parameter.
        parameter: Parameter,
        /// The value given.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// Lower end of the range.
        min: f64,
        /// Upper end of the range.
        max: f64,
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
    #[error("the mixing formula did not converge after {iterations} iterations")]
    NoConvergence {
        /// Iterations done.
        iterations: usize,
    },
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
