//! Errors of reading and rendering a scene.

use crate::atmosphere::PhysicsError;
use crate::geometry::{At, GeometryError};
use crate::surfaces::SurfaceError;
use std::fmt::Display;
use thiserror::Error;

/// Result of this crate.
pub type Result<T, E = SceneError> = std::result::Result<T, E>;

/// An error of reading or rendering a scene.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The text is not the TOML of a scene. The message names the line.
    #[error("the scene description is wrong: {0}")]
    Toml(#[from] toml::de::Error),
    /// The scene cannot be written as TOML.
    #[error("the scene cannot be written: {0}")]
    Write(#[from] toml::ser::Error),
    /// A value outside its range.
    #[error("{what} is {value}, expected {expected}")]
    BadValue {
        /// Name of the value.
        what: String,
        /// The value given.
        value: String,
        /// The values that are accepted.
        expected: &'static str,
    },
    /// A fault at a line of the scene.
    #[error("{at}{message}")]
    At {
        /// Line of the scene.
        at: At,
        /// What is wrong and what to do.
        message: String,
    },
    /// An error of bodies or regions.
    #[error(transparent)]
    Geometry(Box<GeometryError>),
    /// An error of a surface or its layers.
    #[error("{at}surface `{name}`")]
    Surface {
        /// Line of the scene.
        at: At,
        /// Name of the surface.
        name: String,
        /// Cause.
        source: Box<SurfaceError>,
    },
    /// An error of the atmosphere.
    #[error("{at}atmosphere of the scene")]
    Atmosphere {
        /// Line of the scene.
        at: At,
        /// Cause.
        source: Box<PhysicsError>,
    },
    /// An error of the water of a body of weather.
    #[error("{at}weather `{name}`")]
    Weather {
        /// Line of the scene.
        at: At,
        /// Its name.
        name: String,
        /// Cause.
        source: Box<PhysicsError>,
    },
    /// A picture that the scene names and that could not be read.
    #[error("{at}picture `{name}` of the ground")]
    Picture {
        /// Line of the scene.
        at: At,
        /// Its name.
        name: String,
        /// Cause.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A scene with neither solids nor ground.
    #[error("the scene is empty: give it a [ground], or bodies and regions")]
    Empty,
    /// The image could not be made.
    #[error(transparent)]
    Array(#[from] cittert_arrays::ArrayError),
}

impl From<GeometryError> for SceneError {
    fn from(e: GeometryError) -> Self {
        Self::Geometry(Box::new(e))
    }
}

impl From<PhysicsError> for SceneError {
    fn from(e: PhysicsError) -> Self {
        Self::air(At(0), e)
    }
}

impl SceneError {
    /// [`Self::BadValue`] of anything that can be printed.
    pub(crate) fn bad_value(what: impl Display, value: impl Display, expected: &'static str) -> Self {
        Self::BadValue { what: what.to_string(), value: value.to_string(), expected }
    }

    /// [`Self::BadValue`], unless the value is good.
    pub(crate) fn unless(good: bool, what: impl Display, value: impl Display, expected: &'static str) -> Result<()> {
        if good { Ok(()) } else { Err(Self::bad_value(what, value, expected)) }
    }

    /// An error of the atmosphere at a line.
    pub(crate) fn air(at: At, source: PhysicsError) -> Self {
        Self::Atmosphere { at, source: Box::new(source) }
    }

    /// A fault at a line.
    pub(crate) fn at(line: usize, message: impl Into<String>) -> Self {
        Self::At { at: At(line), message: message.into() }
    }
}
