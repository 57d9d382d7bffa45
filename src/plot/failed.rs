//! Failures of the libraries that draw and encode.

use crate::ChainError;

/// The error of a drawing library.
pub(super) fn plot_error(e: impl std::fmt::Display) -> ChainError {
    ChainError::Other(format!("drawing failed: {e}").into())
}
