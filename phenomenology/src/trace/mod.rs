//! The tracer. It follows rays from the sensor back to the sky, and sums the radiation that arrives along them.

mod around;
mod blocks;
mod cause;
mod edges;
mod face;
mod flight;
mod follow;
mod lattice;
mod leg;
mod memory;
mod mesh_options;
mod model_error;
mod options;
mod picture;
mod polar;
mod realtime;
mod render;
mod scatter;
mod scatter_mesh;
mod scratch;
mod smooth;
mod tiles;
mod tracer;
mod vertex;
mod weather;

#[cfg(test)]
mod facet_tests;
#[cfg(test)]
mod lobe_tests;
#[cfg(test)]
mod physics_tests;
#[cfg(test)]
mod sensitivity_tests;
#[cfg(test)]
mod volume_tests;
#[cfg(test)]
mod weather_tests;

pub use cause::{CAUSES, Cause};
pub use flight::{Flight, KeyFrame};
pub use mesh_options::{EdgeOptions, MeshOptions};
pub use model_error::{Extended, ModelError};
pub use options::{RenderOptions, Scale};
pub use picture::{Picture, ProgressFn};
pub use realtime::{Frame, error_map};
pub use tracer::{Seen, Tracer};
