//! The tracer: rays from the sensor back to the sky, and the temperatures forward again.

mod flight;
mod follow;
mod options;
mod picture;
mod polar;
mod realtime;
mod smooth;
mod tracer;

#[cfg(test)]
mod physics_tests;

pub use flight::{Flight, KeyFrame};
pub use options::{RenderOptions, Scale};
pub use picture::{Picture, ProgressFn};
pub use realtime::{Frame, MeshOptions, error_map};
pub use tracer::{Seen, Tracer};
