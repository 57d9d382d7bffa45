//! The table of shapes.

use super::shape::ShapeKind;
use super::{circle, hexagon, polygon, rectangle};

/// All shapes.
pub const SHAPES: &[ShapeKind] = &[
    ShapeKind { name: "circle", sizes: "DIAMETER", make: circle::make, about: "circle" },
    ShapeKind { name: "rectangle", sizes: "WIDTH:HEIGHT", make: rectangle::make, about: "rectangle with horizontal and vertical sides" },
    ShapeKind {
        name: "hexagon",
        sizes: "WIDTH",
        make: hexagon::make,
        about: "regular hexagon with two corners on the horizontal axis; WIDTH from corner to corner",
    },
    ShapeKind {
        name: "polygon",
        sizes: "X:Y:X:Y:X:Y...",
        make: polygon::make,
        about: "corners in their order, from the centre of the pupil",
    },
];
