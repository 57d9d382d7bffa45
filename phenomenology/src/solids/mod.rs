//! Scenes of solids: bodies and regions with surfaces, a ground, an atmosphere and a camera.
//!
//! [`SceneFile`] is the TOML as written. [`SolidScene`] is the checked scene: its assemblies are placed and its names resolved.
//! [`crate::trace::Tracer`] computes its temperatures.

mod air;
mod build;
mod check;
mod covers;
mod file;
mod images;
mod isothermal;
mod place;
mod probe;
mod scene;
mod weather;
mod write;

#[cfg(test)]
mod scene_tests;

pub use covers::{Cover, Covers};
pub use file::{
    AssemblyRow, AtmosphereRow, BodyRow, CanopyRow, FaceRow, GroundRow, HeightFieldRow, InstanceRow, MapRow, PatchRow, RegionRow,
    SceneFile, SurfaceRow, WeatherRow,
};
pub use images::ReadGrey;
pub use probe::{Probed, read_geometry, read_probe_with};
pub use scene::{Air, SolidScene, SurfaceSource};
pub use weather::{Weather, WeatherSource};
