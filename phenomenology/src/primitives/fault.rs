//! Errors of a body.

use thiserror::Error;

/// A code or parameters that give no body.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum PrimitiveFault {
    /// The code of no body.
    #[error("unknown body type `{code}`; known: {known}")]
    UnknownCode {
        /// The code given.
        code: String,
        /// The known codes.
        known: String,
    },
    /// Too few or too many parameters.
    #[error("{code} takes {expected} parameters ({parameters}), not {found}")]
    Count {
        /// The code.
        code: &'static str,
        /// How many it takes.
        expected: usize,
        /// How many were given.
        found: usize,
        /// Their names.
        parameters: &'static str,
    },
    /// A parameter is not a number, or too large.
    #[error("parameter {number} of the {code} is {value}; it must be a number between -1e12 and 1e12")]
    NotFinite {
        /// The code.
        code: &'static str,
        /// Number of the parameter, from 1.
        number: usize,
        /// Its value.
        value: f64,
    },
    /// A length that is not above zero.
    #[error("{what} of the {code} is {value} m; it must be above 0")]
    NotPositive {
        /// The code.
        code: &'static str,
        /// The length.
        what: &'static str,
        /// Its value, m.
        value: f64,
    },
    /// A lower limit at or above the upper limit.
    #[error("the RPP has {axis}min = {min} m and {axis}max = {max} m; the first must be less than the second")]
    Inverted {
        /// The axis.
        axis: char,
        /// Lower limit, m.
        min: f64,
        /// Upper limit, m.
        max: f64,
    },
    /// A vector of length zero, so that the body has no volume.
    #[error("the {code} is singular: {what} has length {length} m; every edge and axis needs a length above 0")]
    Singular {
        /// The code.
        code: &'static str,
        /// The vector.
        what: &'static str,
        /// Its length, m.
        length: f64,
    },
    /// Two vectors that are not perpendicular.
    #[error("the {code} is singular: {first} and {second} meet at {degrees:.4} deg; they must be perpendicular")]
    NotPerpendicular {
        /// The code.
        code: &'static str,
        /// First vector.
        first: &'static str,
        /// Second vector.
        second: &'static str,
        /// Angle between them, degrees.
        degrees: f64,
    },
    /// A major axis that is not longer than the distance between the foci.
    #[error("the ELL has L = {major_m} m and foci {distance_m} m apart; L must be larger")]
    ShortEllipsoid {
        /// Length of the major axis, m.
        major_m: f64,
        /// Distance between the foci, m.
        distance_m: f64,
    },
}

/// A number above zero, or an error.
pub(super) fn positive(code: &'static str, what: &'static str, value: f64) -> Result<f64, PrimitiveFault> {
    if value > 0.0 { Ok(value) } else { Err(PrimitiveFault::NotPositive { code, what, value }) }
}
