//! Scene description to brightness temperature.
//!
//! [`Scene`] is the public face: read one from TOML, render it on a [`cittert_arrays::SkyGrid`].

mod analytic;
pub mod atmosphere;
pub mod constants;
pub mod dielectrics;
mod error;
pub mod geometry;
pub mod primitives;
mod scene;
pub mod surfaces;
pub mod vector;

pub use analytic::{AnalyticScene, Shape};
pub use error::{Result, SceneError};
pub use scene::Scene;
