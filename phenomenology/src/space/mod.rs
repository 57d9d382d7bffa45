//! Vectors, rays and boxes: the geometry that bodies, terrain and the tracer share.

mod bounds;
mod ray;
mod similarity;
mod span;
mod vector;

pub use bounds::Bounds;
pub use ray::Ray;
pub use similarity::Similarity;
pub use span::Span;
pub use vector::Vec3;
