//! Errors of arrays, visibility sets and images.

use std::fmt::Display;
use thiserror::Error;

/// Any error of a format or of an algorithm.
pub type BoxError = Box<dyn std::error::Error + Send + Sync + 'static>;

/// Result of this crate.
pub type Result<T, E = ArrayError> = std::result::Result<T, E>;

/// A broken invariant of one of the types of this crate.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// The shape of an array does not fit the other arrays.
    #[error("{what} has shape {found:?}, expected {expected:?}")]
    ShapeMismatch {
        /// Name of the array.
        what: &'static str,
        /// Shape that the other arrays require.
        expected: Vec<usize>,
        /// Shape that was given.
        found: Vec<usize>,
    },
    /// An index is past the end.
    #[error("{what} {index} is out of range: there are {len}")]
    OutOfRange {
        /// What is indexed.
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        len: usize,
    },
    /// A number is NaN, infinite, negative or otherwise outside its range.
    #[error("{what} is {value}, expected {expected}")]
    BadValue {
        /// Name of the quantity.
        what: String,
        /// What was given, as text.
        value: String,
        /// What is accepted.
        expected: &'static str,
    },
    /// The value of an option is outside the range that is accepted.
    #[error("{option} is {value}, expected {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are accepted.
        expected: String,
    },
    /// Two antennas are at the same position.
    #[error("antennas {first:?} and {second:?} are at the same place ({distance_m:.1e} m apart)")]
    CoincidentAntennas {
        /// Name of the first.
        first: String,
        /// Name of the second.
        second: String,
        /// Their separation in metres.
        distance_m: f64,
    },
    /// A name is used twice or is unknown.
    #[error("{0}")]
    Name(String),
    /// A text could not be understood.
    #[error("{0}")]
    Parse(String),
    /// A quantity could not be understood.
    #[error(transparent)]
    Quantity(#[from] crate::quantity::QuantityError),
    /// A source or sink of visibilities failed.
    #[error(transparent)]
    Stream(BoxError),
}

impl ArrayError {
    /// [`Self::BadValue`] of anything that can be printed.
    #[must_use]
    pub fn bad_value(what: impl Display, value: impl Display, expected: &'static str) -> Self {
        Self::BadValue { what: what.to_string(), value: value.to_string(), expected }
    }

    /// [`Self::BadValue`], unless the value is good.
    ///
    /// # Errors
    /// The value is not good.
    pub fn unless(good: bool, what: impl Display, value: impl Display, expected: &'static str) -> Result<()> {
        if good { Ok(()) } else { Err(Self::bad_value(what, value, expected)) }
    }

    /// [`Self::BadOption`], unless the value of the option is good.
    ///
    /// # Errors
    /// The value is not good.
    pub fn need(option: &'static str, value: impl Display, good: bool, expected: impl Into<String>) -> Result<()> {
        if good { Ok(()) } else { Err(Self::BadOption { option, value: value.to_string(), expected: expected.into() }) }
    }

    /// [`Self::OutOfRange`], unless a range of rows lies within `len` rows.
    ///
    /// # Errors
    /// The range ends past the last row, or before it begins.
    pub fn unless_rows(range: &std::ops::Range<usize>, len: usize) -> Result<()> {
        if range.start <= range.end && range.end <= len { Ok(()) } else { Err(Self::OutOfRange { what: "row", index: range.end, len }) }
    }

    /// [`Self::ShapeMismatch`], unless an array has the shape that the others require.
    ///
    /// # Errors
    /// The shapes differ.
    pub fn unless_shape(what: &'static str, found: &[usize], expected: &[usize]) -> Result<()> {
        if found == expected { Ok(()) } else { Err(Self::ShapeMismatch { what, expected: expected.to_vec(), found: found.to_vec() }) }
    }
}
