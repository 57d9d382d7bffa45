//! What can go wrong in the chain.

use cittert_arrays::{ArrayError, BoxError};
use thiserror::Error;

/// Result of the chain.
pub type Result<T, E = ChainError> = std::result::Result<T, E>;

/// An error of simulation, imaging or calibration.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ChainError {
    /// A broken shape or value, or a stream that failed.
    #[error(transparent)]
    Array(#[from] ArrayError),
    /// An option outside what the algorithm can do.
    #[error("{option} is {value}, expected {expected}")]
    BadOption {
        /// Name of the option as the user knows it.
        option: &'static str,
        /// What was given.
        value: String,
        /// What is accepted.
        expected: String,
    },
    /// The data hold nothing to work on.
    #[error("{0}")]
    NoData(String),
    /// Two inputs that do not belong together.
    #[error("{0}")]
    Incompatible(String),
    /// The user asked to stop.
    #[error("stopped on request")]
    Cancelled,
    /// Anything handed on from below.
    #[error(transparent)]
    Other(BoxError),
}
