//! What can be wrong with a scene.

use crate::atmosphere::PhysicsError;
use crate::geometry::{At, GeometryError};
use crate::surfaces::SurfaceError;
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
    /// The scene cannot be written as TOML.
    #[error("the scene cannot be written: {0}")]
    Write(#[from] toml::ser::Error),
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
    /// Something at a line of the scene that cannot be.
    #[error("{at}{message}")]
    At {
        /// Where.
        at: At,
        /// What is wrong and what to do.
        message: String,
    },
    /// Bodies or regions.
    #[error(transparent)]
    Geometry(Box<GeometryError>),
    /// A surface and its layers.
    #[error("{at}surface `{name}`")]
    Surface {
        /// Where.
        at: At,
        /// Name of the surface.
        name: String,
        /// Why.
        source: Box<SurfaceError>,
    },
    /// The atmosphere.
    #[error("{at}atmosphere of the scene")]
    Atmosphere {
        /// Where.
        at: At,
        /// Why.
        source: Box<PhysicsError>,
    },
    /// A region without a surface.
    #[error("{at}region `{region}` has no material; give it surface = \"...\" ({known})")]
    MissingMaterial {
        /// Where.
        at: At,
        /// The region.
        region: String,
        /// The surfaces there are.
        known: String,
    },
    /// A surface that is used but not described.
    #[error("{at}{user} uses unknown surface `{name}`; {known}")]
    UnknownSurface {
        /// Where.
        at: At,
        /// What uses it.
        user: String,
        /// The surface.
        name: String,
        /// The surfaces there are.
        known: String,
    },
    /// A picture that the scene names.
    #[error("{at}picture `{name}` of the ground")]
    Picture {
        /// Where.
        at: At,
        /// Its name.
        name: String,
        /// Why.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// Neither solids nor ground.
    #[error("the scene is empty: give it a [ground], or bodies and regions")]
    Empty,
    /// The camera lies inside a solid.
    #[error("{at}the camera at {position_m:?} m lies inside region `{region}`; move it out")]
    CameraInside {
        /// Where.
        at: At,
        /// Position, m.
        position_m: [f64; 3],
        /// The region.
        region: String,
    },
    /// The camera lies below the ground.
    #[error("{at}the camera at {position_m:?} m lies under the ground, which is at {ground_m} m there; raise it")]
    CameraUnderGround {
        /// Where.
        at: At,
        /// Position, m.
        position_m: [f64; 3],
        /// Height of the ground, m.
        ground_m: f64,
    },
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
    /// A fault of the air, wherever it was met.
    pub(crate) fn air(at: At, source: PhysicsError) -> Self {
        Self::Atmosphere { at, source: Box::new(source) }
    }

    /// A fault at a line.
    pub(crate) fn at(line: usize, message: impl Into<String>) -> Self {
        Self::At { at: At(line), message: message.into() }
    }
}
