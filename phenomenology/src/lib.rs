//! Radiometric scene simulator: from the description of a scene to an image of brightness temperature.
//!
//! Read a [`Scene`] from TOML, and render it on a [`cittert_arrays::SkyGrid`].

mod analytic;
pub mod atmosphere;
pub mod camera;
pub mod constants;
pub mod dielectrics;
mod error;
pub mod geometry;
pub mod measured;
#[cfg(test)]
mod oracle_tests;
pub mod primitives;
pub mod radiometry;
mod scene;
pub mod solids;
pub mod space;
pub mod surfaces;
pub mod terrain;
pub mod trace;

pub use analytic::{AnalyticScene, Shape};
pub use camera::{Camera, Projection, View};
pub use error::{Result, SceneError};
pub use scene::Scene;
pub use solids::SolidScene;
pub use trace::{Picture, RenderOptions, Scale, Tracer};
