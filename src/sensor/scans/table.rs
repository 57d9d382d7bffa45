//! The table of scan patterns.

use super::kind::ScanKind;
use super::{array, conical, pushbroom, raster};

/// All patterns.
pub const SCANS: &[ScanKind] = &[
    ScanKind {
        name: "array",
        size: None,
        make: array::make,
        about: "a focal-plane array: a detector for each pixel, which looks at it for the whole frame",
    },
    ScanKind { name: "raster", size: None, make: raster::make, about: "one beam, or several below each other, that scans line after line" },
    ScanKind {
        name: "conical",
        size: Some("RADIUS"),
        make: conical::make,
        about: "a beam that turns around an axis at this angle from it, while the axis moves along the rows; lines are arcs",
    },
    ScanKind {
        name: "pushbroom",
        size: None,
        make: pushbroom::make,
        about: "a line of detectors along the columns that moves along the rows",
    },
];
