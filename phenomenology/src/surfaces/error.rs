//! Errors of the surface models.

use crate::dielectrics::DielectricError;
use thiserror::Error;

/// An error of the surface models.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SurfaceError {
    /// A permittivity could not be found.
    #[error(transparent)]
    Dielectric(#[from] DielectricError),
    /// The angle of incidence is outside 0 to below 90 degrees.
    #[error("angle is {degrees} degrees from the normal; it must be at least 0 and below 90")]
    Angle {
        /// The angle given, degrees.
        degrees: f64,
    },
    /// The azimuth is not a number.
    #[error("azimuth is {degrees} degrees; it must be a finite number")]
    Azimuth {
        /// The azimuth given, degrees.
        degrees: f64,
    },
    /// An input that cannot be used. The message has the value and what is accepted.
    #[error("{0}")]
    Refused(String),
    /// A number is outside its range.
    #[error("{what} is {value}; it must lie in {min} to {max}")]
    Value {
        /// Name of the number.
        what: &'static str,
        /// The value given.
        value: f64,
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// A stack without layers.
    #[error("the stack has no [[layer]]; give at least one, the last without thickness_m")]
    NoLayers,
    /// A layer of a stack is wrong.
    #[error("layer {layer}{place}: {message}")]
    Layer {
        /// Number of the layer from the top, starting at 1.
        layer: usize,
        /// Its line in the file, such as ` (line 7)`; empty if not from a file.
        place: String,
        /// What is wrong and what to do.
        message: String,
    },
    /// A layer whose permittivity could not be found.
    #[error("layer {layer}{place}")]
    LayerMaterial {
        /// Number of the layer from the top, starting at 1.
        layer: usize,
        /// Its line in the file.
        place: String,
        /// Cause.
        source: DielectricError,
    },
}

/// Cosine of an angle of incidence, after a check.
pub(crate) fn cos_incidence(theta_rad: f64) -> Result<f64, SurfaceError> {
    let limit = std::f64::consts::FRAC_PI_2;
    if theta_rad >= 0.0 && theta_rad < limit * (1.0 - 1e-12) {
        Ok(theta_rad.cos())
    } else {
        Err(SurfaceError::Angle { degrees: theta_rad.to_degrees() })
    }
}

/// A number inside its bounds, or an error.
pub(crate) fn bounded(what: &'static str, value: f64, min: f64, max: f64) -> Result<f64, SurfaceError> {
    if value >= min && value <= max { Ok(value) } else { Err(SurfaceError::Value { what, value, min, max }) }
}
