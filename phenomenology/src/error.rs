//! What can be wrong with a scene.

use thiserror::Error;

/// Result of this crate.
pub type Result<T, E = SceneError> = std::result::Result<T, E>;

/// An error of reading or rendering a scene.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The TOML is not a scene; the message points at the line.
    #[error("the scene description is wrong: {0}")]
    Toml(#[from] toml::de::Error),
    /// A value outside its range.
    #[error("{what} is {value}, expected {expected}")]
    BadValue {
        /// What it belongs to.
        what: String,
        /// What was given.
        value: String,
        /// What is accepted.
        expected: &'static str,
    },
    /// The image could not be made.
    #[error(transparent)]
    Array(#[from] cittert_arrays::ArrayError),
}
