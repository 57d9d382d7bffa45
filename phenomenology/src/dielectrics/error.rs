//! Errors of the dielectric data base.

use super::state::Range;
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
    /// A state or a question that makes no sense for the material. The message has the value and what is accepted.
    #[error("{0}")]
    Refused(String),
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
