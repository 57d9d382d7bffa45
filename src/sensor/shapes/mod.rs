//! The shapes of openings. A new shape is a file in this folder and a row of [`SHAPES`].

mod aperture;
mod circle;
mod hexagon;
mod polygon;
mod rectangle;
mod shape;
mod table;

pub use aperture::Aperture;
pub use shape::{MadeShape, Shape, ShapeKind};
pub use table::SHAPES;
