//! Scenes of solids: bodies and regions with surfaces, on a ground, under an atmosphere, before a camera.
//!
//! [`SceneFile`] is the TOML as written; [`SolidScene`] is the scene made of it: assemblies placed, names looked up,
//! everything checked. [`crate::trace::Tracer`] turns it into temperatures.

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
mod write;

#[cfg(test)]
mod scene_tests;

pub use covers::{Cover, Covers};
pub use file::{
    AssemblyRow, AtmosphereRow, BodyRow, CanopyRow, FaceRow, GroundRow, HeightFieldRow, InstanceRow, MapRow, PatchRow, RegionRow,
    SceneFile, SurfaceRow,
};
pub use images::ReadGrey;
pub use probe::{Probed, read_geometry, read_probe_with};
pub use scene::{Air, SolidScene, SurfaceSource};
