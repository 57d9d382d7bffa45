//! Errors of the chain.

use cittert_arrays::{ArrayError, BoxError};
use thiserror::Error;

/// Result of the chain.
pub type Result<T, E = ChainError> = std::result::Result<T, E>;

/// An error of simulation, imaging or calibration.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChainError {
    /// An array has a wrong shape or a wrong value, or a stream of visibilities failed.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// The value of an option is outside the range that the algorithm accepts.
    #[error("{option} is {value}, expected {expected}")]
    BadOption {
        /// Name of the option.
        option: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are accepted.
        expected: String,
    },
    /// The data hold nothing that can be used.
    #[error("{0}")]
    NoData(String),
    /// Two inputs do not belong together.
    #[error("{0}")]
    Incompatible(String),
    /// Gains were solved at times or frequencies that are far from those of the data.
    #[error("the gains were not solved for these data: {0}. Use the table that belongs to them")]
    FarGains(String),
    /// A condition that the program itself must ensure does not hold.
    #[error("internal error: {0}; please report it")]
    Internal(String),
    /// The observer asked to stop.
    #[error("stopped on request")]
    Cancelled,
    /// An error of another crate.
    #[error(transparent)]
    Other(BoxError),
}

impl ChainError {
    /// The value of an option is not accepted.
    pub(crate) fn bad_option(option: &'static str, value: impl ToString, expected: impl Into<String>) -> Self {
        Self::BadOption { option, value: value.to_string(), expected: expected.into() }
    }
}

/// Return `error` from the function unless `condition` holds. A comparison with NaN does not hold.
macro_rules! ensure {
    ($condition:expr, $error:expr) => {
        if !$condition {
            return Err($error);
        }
    };
}
pub(crate) use ensure;
