//! The ground: a plane or a height field, with patches of several surfaces.

mod ground;
mod height_field;
mod hit;
mod map;
mod patch;
mod patch_index;

pub use ground::Terrain;
pub use height_field::HeightField;
pub use hit::GroundHit;
pub use map::SurfaceMap;
pub(crate) use patch::strip;
pub use patch::{Patch, Shape};
pub use patch_index::Few;
