//! The tracer: rays from the sensor back to the sky, and the temperatures forward again.

mod follow;
mod options;
mod picture;
mod polar;
mod tracer;

#[cfg(test)]
mod physics_tests;

pub use options::{RenderOptions, Scale};
pub use picture::{Picture, ProgressFn};
pub use tracer::{Seen, Tracer};
