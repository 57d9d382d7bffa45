//! Vectors, rays and boxes: the geometry that bodies, terrain and the tracer share.

mod beam;
mod bounds;
mod ray;
mod similarity;
mod span;
mod vector;

pub use beam::Beam;
pub use bounds::Bounds;
pub use ray::Ray;
pub use similarity::Similarity;
pub use span::Span;
pub use vector::Vec3;
